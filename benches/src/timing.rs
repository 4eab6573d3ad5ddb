//! Time spent by one thread.

use cpu_time::ThreadTime;
use std::time::Duration;

/// A measurement ends after the round in which it has taken this long.
const PATIENCE: Duration = Duration::from_secs(12);

/// Runs all of `work` in turn, for up to `rounds` rounds; the least CPU time of this thread that
/// each took.
///
/// The least, because whatever else the machine does can only add; in turn, so that a busy moment
/// meets all alike; twice in each turn, since after the others' the caches hold nothing of one's own,
/// which costs the quickest method the most. Work that is shared among threads must be run in a pool of one, see
/// [`on_one_thread`].
pub fn least_times<const N: usize>(rounds: u32, mut work: [&mut dyn FnMut(); N]) -> [Duration; N] {
    let begin = ThreadTime::now();
    let mut least = [Duration::MAX; N];
    for round in 0..rounds.max(1) {
        if round > 0 && begin.elapsed() > PATIENCE {
            break;
        }
        for (least, work) in least.iter_mut().zip(&mut work) {
            for _ in 0..2 {
                let start = ThreadTime::now();
                work();
                *least = (*least).min(start.elapsed());
            }
        }
    }
    least
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twice_the_work_takes_longer() {
        let spin = |steps: u64| {
            move || {
                std::hint::black_box(
                    (0..steps).fold(1_u64, |x, k| std::hint::black_box(x).wrapping_mul(k | 1)),
                );
            }
        };
        let [once, thrice] = least_times(5, [&mut spin(1_000_000), &mut spin(3_000_000)]);
        assert!(
            thrice > once,
            "{thrice:?} for three times what takes {once:?}"
        );
    }

    #[test]
    fn parallel_work_stays_on_the_one_thread() {
        use rayon::prelude::*;
        let ids: Vec<_> = on_one_thread(|| {
            let mut ids: Vec<_> = (0..64_u32)
                .into_par_iter()
                .map(|_| std::thread::current().id())
                .collect();
            ids.push(std::thread::current().id());
            ids
        });
        assert!(ids.windows(2).all(|pair| pair[0] == pair[1]));
    }
}
