//! How far a long run is, on standard error; silent when that is not a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over `units` of work with the time that is left.
///
/// # Panics
/// Never: the template is a constant that is tested.
pub fn bar(units: usize, what: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} [{bar:36}] {percent:>3}%, {eta} left")
        .expect("the template is valid")
        .progress_chars("=> ");
    ProgressBar::new(units as u64)
        .with_style(style)
        .with_message(what.to_owned())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_template_is_valid_and_the_bar_counts() {
        let bar = super::bar(3, "Evaluating");
        bar.inc(2);
        assert_eq!(bar.position(), 2);
        assert_eq!(bar.length(), Some(3));
    }
}
