//! Questions to the image and to the host's tracker that leave the track as it is.

use bnkf::protocol::{ForecastFrame, HORIZONS, LikelihoodFrame, RefusalCode};
use bnkf::{Measurement, Tracker};

use crate::filter::HORIZONS_US;
use crate::image::session::{ImageSession, SessionError};

const _: () = assert!(HORIZONS == HORIZONS_US.len());

/// Answers of one kind, compared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Questions {
    /// Questions asked.
    pub asked: usize,
    /// Questions with the same answer to the last bit, or refused alike.
    pub identical: usize,
    /// Cost of each answer, counter ticks: instructions in QEMU.
    pub ticks: Vec<u32>,
}

impl Questions {
    /// Asks where the target will be at the evaluation's horizons after `time_us`.
    ///
    /// # Errors
    /// The image does not answer.
    pub fn ask_forecast(
        &mut self,
        session: &mut ImageSession,
        tracker: &mut Tracker<'_>,
        time_us: u64,
    ) -> Result<(), SessionError> {
        let times_us = HORIZONS_US.map(|ahead_us| time_us + ahead_us);
        let image = session.forecast(times_us)?;
        let host = tracker.forecasts(&times_us);
        let host = host.map(|forecasts| ForecastFrame::new(&forecasts, 0));
        let ticks = |frame: &ForecastFrame| frame.ticks;
        let host = host.map_err(RefusalCode::from);
        self.take(&image, &host, ForecastFrame::same_bits, ticks);
        Ok(())
    }

    /// Asks how well a measurement fits the track.
    ///
    /// # Errors
    /// The image does not answer.
    pub fn ask_likelihood(
        &mut self,
        session: &mut ImageSession,
        tracker: &mut Tracker<'_>,
        measurement: &Measurement,
    ) -> Result<(), SessionError> {
        let image = session.likelihood(measurement)?;
        let host = tracker.likelihood(measurement);
        let host = host.map(|likelihood| LikelihoodFrame::new(&likelihood, 0));
        let ticks = |frame: &LikelihoodFrame| frame.ticks;
        let host = host.map_err(RefusalCode::from);
        self.take(&image, &host, LikelihoodFrame::same_bits, ticks);
        Ok(())
    }

    /// Whether every answer agreed.
    pub fn all_identical(&self) -> bool {
        self.identical == self.asked
    }

    fn take<T>(
        &mut self,
        image: &Result<T, RefusalCode>,
        host: &Result<T, RefusalCode>,
        same_bits: fn(&T, &T) -> bool,
        ticks: fn(&T) -> u32,
    ) {
        self.asked += 1;
        self.identical += usize::from(match (image, host) {
            (Ok(image), Ok(host)) => same_bits(image, host),
            (Err(image), Err(host)) => image == host,
            _ => false,
        });
        self.ticks.extend(image.as_ref().ok().map(ticks));
    }
}

#[cfg(test)]
mod tests {
    use bnkf::protocol::RefusalCode;

    use super::Questions;

    #[test]
    fn answers_are_alike_or_not() {
        let mut questions = Questions::default();
        let mut take = |image, host| questions.take(&image, &host, u32::eq, |ticks| *ticks);
        take(Ok(7), Ok(7));
        take(Ok(8), Ok(9));
        take(Err(RefusalCode::Time), Err(RefusalCode::Time));
        take(Err(RefusalCode::Time), Err(RefusalCode::Lost));
        take(Err(RefusalCode::Time), Ok(1));
        assert_eq!((questions.asked, questions.identical), (5, 2));
        assert_eq!(questions.ticks, [7, 8]);
        assert!(!questions.all_identical());
    }
}
