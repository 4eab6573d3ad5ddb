//! Time spent by one thread.

use cpu_time::ThreadTime;
use std::time::Duration;

/// A measurement stops early once it has taken this long.
const PATIENCE: Duration = Duration::from_secs(8);

/// Runs `work` up to `repetitions` times, at least once; the least CPU time of this thread, and
/// what the last run gave.
///
/// The least, because whatever else the machine does can only add. Work that is shared among
/// threads must be run in a pool of one, see [`on_one_thread`].
pub fn least_time<T>(repetitions: u32, mut work: impl FnMut() -> T) -> (Duration, T) {
    let begin = ThreadTime::now();
    let mut least = Duration::MAX;
    let mut repetition = 0;
    loop {
        let start = ThreadTime::now();
        let result = std::hint::black_box(work());
        least = least.min(start.elapsed());
        repetition += 1;
        if repetition >= repetitions || begin.elapsed() > PATIENCE {
            return (least, result);
        }
        // Dropped before the next run, as a program that makes one picture would never hold two.
        drop(result);
    }
}

/// Runs `work` on a thread whose parallel work stays on that thread.
///
/// # Panics
/// If the thread cannot be started.
pub fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("one thread can be started")
        .install(work)
}

/// A duration in milliseconds.
pub fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
