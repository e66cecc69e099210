//! `metrolux study` and `predict`, as a user meets them, and the figures behind them.

mod browser;
mod command;
mod predict;
mod slope;
