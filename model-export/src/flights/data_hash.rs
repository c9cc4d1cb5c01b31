//! SHA-256 fingerprints that say which data and which blob a result came from.

use sha2::{Digest, Sha256};

use crate::flights::flight::Flight;

/// Lower-case hexadecimal SHA-256 of `bytes`: what `sha256sum` prints for a file.
#[must_use]
pub fn of_bytes(bytes: &[u8]) -> String {
    hexadecimal(Sha256::digest(bytes).as_slice())
}

/// Fingerprint of `flights` in their order: names, sources and the bits of every sample.
#[must_use]
pub fn of_flights(flights: &[Flight]) -> String {
    let mut hash = FlightsHash::default();
    for flight in flights {
        hash.add(flight);
    }
    hash.finish()
}

/// [`of_flights`], which takes one flight after another.
#[derive(Clone, Debug, Default)]
pub struct FlightsHash(Sha256);

impl FlightsHash {
    /// Adds a flight.
    pub fn add(&mut self, flight: &Flight) {
        let hash = &mut self.0;
        for text in [&flight.name, &flight.source] {
            // The length keeps ("ab", "c") apart from ("a", "bc").
            hash.update((text.len() as u64).to_le_bytes());
            hash.update(text.as_bytes());
        }
        hash.update((flight.samples.len() as u64).to_le_bytes());
        for sample in &flight.samples {
            let values = sample.position_m.iter().chain(&sample.velocity_mps);
            for value in std::iter::once(&sample.time_s).chain(values) {
                hash.update(value.to_bits().to_le_bytes());
            }
        }
    }

    /// The fingerprint.
    #[must_use]
    pub fn finish(self) -> String {
        hexadecimal(self.0.finalize().as_slice())
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::{of_bytes, of_flights};
    use crate::flights::flight::Flight;

    #[test]
    fn bytes_hash_as_published() {
        // FIPS 180-2, appendix B.1.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(of_bytes(b"abc"), abc);
    }

    #[test]
    fn any_change_of_the_flights_shows() {
        let rows = [
            [0.0, 1.0, 2.0, 3.0],
            [1.0, 2.0, 2.0, 3.0],
            [2.0, 3.0, 2.0, 3.0],
        ];
        let one = Flight::from_track("ab", "c", &rows).unwrap();
        let renamed = Flight::from_track("a", "bc", &rows).unwrap();
        let mut moved = one.clone();
        moved.samples[2].position_m[1] += 1e-12;
        let base = of_flights(std::slice::from_ref(&one));
        assert_eq!(base, of_flights(std::slice::from_ref(&one)));
        assert_ne!(base, of_flights(std::slice::from_ref(&renamed)));
        assert_ne!(base, of_flights(&[moved]));
        assert_ne!(
            of_flights(&[one.clone(), renamed.clone()]),
            of_flights(&[renamed, one])
        );
    }
}
