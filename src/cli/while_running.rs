//! Options that tell a render what to do while it runs and what to keep of it. Commands that look at a render without making
//! it take its other options, and refuse these.

use super::CliError;
use super::render_args::RenderArgs;
use super::voice::ProgressArg;

/// Their long names.
const NAMES: [&str; 10] = [
    "checkpoint",
    "every",
    "resume",
    "extend",
    "shard",
    "preview",
    "stats",
    "record-rays",
    "log",
    "progress",
];

/// Which of [`NAMES`] are there.
fn given(args: &RenderArgs) -> [bool; NAMES.len()] {
    [
        args.checkpoint.is_some(),
        // These two go with --checkpoint.
        false,
        false,
        !args.extend.is_empty(),
        args.shard.is_some(),
        args.preview.is_some(),
        args.stats.is_some(),
        args.record_rays.is_some(),
        args.voice.log.is_some(),
        args.voice.progress != ProgressArg::Auto,
    ]
}

/// That none of them is there, for the command of this name.
///
/// # Errors
/// The first that is there.
pub fn refuse(args: &RenderArgs, command: &str) -> Result<(), CliError> {
    match NAMES.iter().zip(given(args)).find(|o| o.1) {
        None => Ok(()),
        Some((name, _)) => Err(CliError::Usage(format!(
            "--{name} is for renders that are made and kept: `metrolux {command}` cannot take it"
        ))),
    }
}

/// A render's words without them, as a command that looks at it takes them.
pub fn without(words: &[String]) -> Vec<String> {
    let mut left = Vec::new();
    let mut words = words.iter().peekable();
    while let Some(word) = words.next() {
        if word == "--" {
            left.push(word.clone());
            left.extend(words.cloned());
            break;
        }
        let option = word.strip_prefix("--").unwrap_or("");
        let (name, own_value) = match option.split_once('=') {
            Some((name, _)) => (name, true),
            None => (option, false),
        };
        if !NAMES.contains(&name) {
            left.push(word.clone());
            continue;
        }
        // --resume has its value, if any, in the same word; --extend takes all words up to the next option.
        let most = match name {
            _ if own_value => 0,
            "resume" => 0,
            "extend" => usize::MAX,
            _ => 1,
        };
        for _ in 0..most {
            if words.next_if(|w| !w.starts_with('-')).is_none() {
                break;
            }
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::render_args::{long_names, parse};

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn what_is_left_is_what_another_command_takes() {
        let all = "a.pbrt -o a.exr --checkpoint a.run --every=5m --resume --seed 3 --log json --extend b c d --layers depth \
                   --progress plain --shard 1/2 -q --record-rays=r --stats s.json";
        let left = without(&words(all));
        assert_eq!(left, words("a.pbrt -o a.exr --seed 3 --layers depth -q"));
        assert!(refuse(&parse(&left).expect("arguments"), "plan").is_ok());
        let left = without(&words(
            "--preview tev:h:1 --resume=require --set=--log -- --log",
        ));
        assert_eq!(left, words("--set=--log -- --log"));
    }

    #[test]
    fn each_is_an_option_of_render_and_refused() {
        let known = long_names();
        for name in NAMES {
            assert!(known.iter().any(|k| k == name), "{name}");
        }
        for option in [
            "--checkpoint=a",
            "--checkpoint=a --every=1m",
            "--checkpoint=a --resume",
            "--extend a",
            "--shard=1/2",
            "--preview=tev",
            "--stats=a",
            "--record-rays=a",
            "--log=json",
            "--progress=plain",
        ] {
            let args = parse(&words(&format!("a.pbrt {option}"))).expect("arguments");
            let e = refuse(&args, "verify").expect_err(option).to_string();
            let name = option.split(['=', ' ']).next().expect("a name");
            assert!(e.contains(name) && e.contains("metrolux verify"), "{e}");
        }
    }
}
