//! Two pieces of work measured against each other on a machine that others use too.

use metrolux::study::process::processor_seconds;
use std::time::Instant;

/// Wall time and processor time of one run, in seconds. Other people's load lengthens the first much, the second little.
#[derive(Clone, Copy)]
pub struct Cost {
    pub wall: f64,
    pub cpu: f64,
}

impl Cost {
    fn of(work: &mut dyn FnMut()) -> Self {
        let (start, cpu) = (Instant::now(), processor_seconds());
        work();
        Self {
            wall: start.elapsed().as_secs_f64(),
            cpu: processor_seconds() - cpu,
        }
    }
}

/// Runs both in turn, so often, after one turn that does not count. Who begins alternates.
pub fn paired(repeats: usize, mut a: impl FnMut(), mut b: impl FnMut()) -> Vec<(Cost, Cost)> {
    a();
    b();
    let mut turn = |i: usize| {
        if i.is_multiple_of(2) {
            let first = Cost::of(&mut a);
            (first, Cost::of(&mut b))
        } else {
            let first = Cost::of(&mut b);
            (Cost::of(&mut a), first)
        }
    };
    (0..repeats).map(&mut turn).collect()
}
