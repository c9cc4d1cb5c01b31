//! How far a training run is, on standard error: a bar with loss and time left on a terminal, a
//! line now and then elsewhere.

use crate::memoryless::training::EpochReport;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::{Duration, Instant};

/// Bar positions per epoch.
const PER_EPOCH: f64 = 1000.0;
/// Time between two lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(15);

/// The display of one run.
pub struct TrainingProgress {
    bar: ProgressBar,
    epochs: u32,
    held_out: String,
    last_line: Option<Instant>,
}

impl TrainingProgress {
    /// A display of `epochs` epochs, of which `done` were done before.
    ///
    /// # Panics
    /// Never: the template is a constant that is tested.
    #[must_use]
    pub fn new(epochs: u32, done: u32) -> Self {
        let style = ProgressStyle::with_template("{msg} [{bar:24}] {percent}%, {eta} left")
            .expect("the template is valid")
            .progress_chars("=> ");
        let length = (f64::from(epochs) * PER_EPOCH) as u64;
        let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
        bar.set_style(style);
        bar.set_position((f64::from(done) * PER_EPOCH) as u64);
        // The time left is estimated from what this process did.
        bar.reset_eta();
        Self {
            bar,
            epochs,
            held_out: "-".to_owned(),
            last_line: None,
        }
    }

    /// Part `done` of the epoch after `epoch` complete ones is done, at the mean loss `loss`.
    pub fn batch(&self, epoch: u32, done: f64, loss: f64) {
        self.bar
            .set_position(((f64::from(epoch) + done) * PER_EPOCH) as u64);
        let held_out = &self.held_out;
        self.bar.set_message(format!(
            "epoch {}/{} loss {loss:.4} held-out {held_out}",
            epoch + 1,
            self.epochs
        ));
    }

    /// An epoch is done.
    pub fn epoch(&mut self, report: &EpochReport) {
        self.held_out = format!("{:.4}", report.validation_loss);
        self.batch(report.epoch - 1, 1.0, report.training_loss);
        let due = self
            .last_line
            .is_none_or(|last| last.elapsed() >= LINE_EVERY);
        if self.bar.is_hidden() && (due || report.epoch == self.epochs) {
            self.last_line = Some(Instant::now());
            eprintln!("{}, {:.0?} left", line(report, self.epochs), self.bar.eta());
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

fn line(report: &EpochReport, epochs: u32) -> String {
    format!(
        "epoch {}/{epochs}: loss {:.4} + divergence {:.4}, held-out {:.4}{}",
        report.epoch,
        report.training_loss,
        report.divergence,
        report.validation_loss,
        if report.better { " (best)" } else { "" },
    )
}

#[cfg(test)]
mod tests {
    use super::{TrainingProgress, line};
    use crate::memoryless::training::EpochReport;

    const REPORT: EpochReport = EpochReport {
        epoch: 3,
        training_loss: 1.25,
        divergence: 0.5,
        validation_loss: 1.5,
        better: true,
    };

    #[test]
    fn the_template_is_valid_and_the_bar_moves() {
        let mut progress = TrainingProgress::new(4, 2);
        progress.batch(2, 0.5, 1.0);
        assert_eq!(progress.bar.position(), 2500);
        progress.epoch(&REPORT);
        assert_eq!(progress.bar.position(), 3000);
        assert!(
            progress
                .bar
                .message()
                .contains("epoch 3/4 loss 1.2500 held-out 1.5000")
        );
    }

    #[test]
    fn lines_hold_losses() {
        assert_eq!(
            line(&REPORT, 9),
            "epoch 3/9: loss 1.2500 + divergence 0.5000, held-out 1.5000 (best)"
        );
    }
}
