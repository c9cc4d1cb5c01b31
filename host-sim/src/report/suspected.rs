//! A flight on which the recursive tracker has something to suspect, and what it made of it.

use bnkf::blob::Kind;
use bnkf_model_export::radar::errors::spoil;
use bnkf_model_export::radar::noise::NoiseLevel;
use bnkf_model_export::random_source::RandomSource;
use bnkf_model_export::seed::name_id;

use crate::campaign::Campaign;
use crate::contest::model::Model;
use crate::contest::suspicion::suspicions;
use crate::manoeuvre::bursts::bursts;
use crate::plot::suspicion_figure;
use crate::scenario::radar::Condition;

/// Readings that are made wrong.
const WRONG: usize = 4;

/// Caption and figure; nothing without a recursive tracker. The flight is made for it: few flights of the
/// evaluation give reason to doubt.
pub(super) fn draw(campaign: &Campaign) -> Option<(String, String)> {
    let mut blobs = campaign.shipped.iter().map(Model::blob);
    let blob = blobs.find(|blob| blob.kind() == Kind::Recursive)?;
    let radar = &campaign.scenario.radar;
    let condition = Condition {
        table: radar.tables[0],
        noise: NoiseLevel::Low,
        rate: radar.rates[0],
    };
    let flight = bursts(campaign.runs.first().first()?, campaign.seed);
    let mut readings = radar.readings(&flight, condition, campaign.seed);
    let mut random = RandomSource::new(campaign.seed, &[name_id("wrong readings")]);
    let mut wrong_s = Vec::new();
    for number in 1..=WRONG {
        let index = number * readings.len() / (WRONG + 1);
        if let Some(Some(reading)) = readings.get_mut(index) {
            spoil(reading, &mut random);
            wrong_s.push(flight.samples[index].time_s - flight.samples[0].time_s);
        }
    }
    let steps = suspicions(blob, &flight, &readings);
    let title = format!("{}, low noise, rate {}", flight.name, condition.rate);
    let caption = format!(
        "A flight made for this figure: from the place where the first one begins it hovers, bursts with 10 m/s\u{b2} and \
         brakes as hard, and {} readings were moved by 5 to 50 of their standard deviations in one channel. With every \
         reading the tracker weighs whether the target did what the network expects, manoeuvred, or was measured wrongly; \
         what is neither blue nor orange is what it expects.",
        wrong_s.len()
    );
    Some((caption, suspicion_figure::draw(&title, &steps, &wrong_s)))
}
