//! Any bytes as a scenario file.

use bnkf_host_sim::scenario::Scenario;

/// Panics where the parser panics, accepts what has no end, or says more than a line.
pub fn run(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    match Scenario::parse(text, "s.toml") {
        Ok(scenario) => {
            let flights = scenario.count.max(scenario.quick_count) as f64;
            assert!(flights * scenario.duration_s * scenario.rate_hz < 6e6);
            assert!(scenario.radar.conditions().len() <= 60);
            assert_eq!(scenario.volume.check(), Ok(()));
            assert!(scenario.volume.range_m_max <= 50_000.0);
            assert!(!scenario.name.contains(char::is_control));
        }
        Err(error) => {
            let text = error.to_string();
            assert!(text.starts_with("s.toml:"), "{text}");
            assert!(!text.contains('\n'), "{text:?}");
        }
    }
}
