//! How far a recursive training run is, on standard error: a bar on a terminal, a line now and then
//! elsewhere.

use super::training::EpisodeReport;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::{Duration, Instant};

/// Time between two lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(15);
/// Weight of the newest episode in the loss that is shown.
const SMOOTHING: f64 = 0.05;

/// The display of one run.
pub struct RecursiveProgress {
    bar: ProgressBar,
    smoothed: Option<f64>,
    lost: usize,
    last_line: Option<Instant>,
}

impl RecursiveProgress {
    /// A display of `episodes` episodes, of which `done` were done before.
    ///
    /// # Panics
    /// Never: the template is a constant that is tested.
    #[must_use]
    pub fn new(episodes: u64, done: u64) -> Self {
        let style = ProgressStyle::with_template("{msg} [{bar:24}] {pos}/{len}, {eta} left")
            .expect("the template is valid")
            .progress_chars("=> ");
        let bar = ProgressBar::with_draw_target(Some(episodes), ProgressDrawTarget::stderr());
        bar.set_style(style);
        bar.set_position(done);
        // The time left is estimated from what this process did.
        bar.reset_eta();
        Self {
            bar,
            smoothed: None,
            lost: 0,
            last_line: None,
        }
    }

    /// One more episode is done.
    pub fn episode(&mut self, report: &EpisodeReport) {
        let before = self.smoothed.unwrap_or(report.surprise);
        let loss = before + SMOOTHING * (report.surprise - before);
        self.smoothed = Some(loss);
        self.lost += report.lost;
        self.bar.inc(1);
        self.bar.set_message(format!("loss {loss:.3} nats"));
        let due = self
            .last_line
            .is_none_or(|last| last.elapsed() >= LINE_EVERY);
        if self.bar.is_hidden() && due {
            self.last_line = Some(Instant::now());
            eprintln!(
                "episode {}/{}: loss {loss:.3} nats, {} flights lost, {:.0?} left",
                self.bar.position(),
                self.bar.length().unwrap_or(0),
                self.lost,
                self.bar.eta()
            );
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_template_is_valid_and_the_bar_moves() {
        let mut progress = RecursiveProgress::new(10, 4);
        for surprise in [1.0, 2.0] {
            progress.episode(&EpisodeReport {
                surprise,
                norm: 0.0,
                lost: 0,
                updates: 3,
            });
        }
        assert_eq!(progress.bar.position(), 6);
        assert_eq!(progress.smoothed, Some(1.05));
    }
}
