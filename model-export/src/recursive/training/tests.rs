//! Trainings that begin, go on and are resumed.

use super::*;
use crate::blob::quantise::layer_errors;
use crate::flights::generator::{GeneratorSettings, generate};
use bnkf::recursive::hypotheses::Hypotheses;

fn recipe() -> Recipe {
    Recipe {
        episodes: 3,
        flights: 32,
        ..Recipe::DEFAULT
    }
}

fn flights() -> Vec<Flight> {
    let settings = GeneratorSettings {
        flights: 12,
        ..GeneratorSettings::default()
    };
    generate(&settings).unwrap()
}

#[test]
fn a_resumed_run_ends_with_the_same_bits() {
    let flights = flights();
    let mut whole = Training::new(recipe(), &flights).unwrap();
    let first = whole.episode();
    assert!(first.surprise.is_finite() && first.updates >= 2);
    let checkpoint = whole.checkpoint();
    whole.episode();
    let mut resumed = Training::new(recipe(), &flights)
        .unwrap()
        .resumed(&checkpoint)
        .unwrap();
    resumed.episode();
    assert_eq!(resumed.network.to_state(), whole.network.to_state());
    assert_eq!(resumed.checkpoint(), whole.checkpoint());
}

/// Population, normalisation and the first weights are the model's; after a break it goes on alike, and from no other's checkpoint.
#[test]
fn a_training_goes_on_from_a_model() {
    let flights = flights();
    let mut first = Training::new(recipe(), &flights).unwrap();
    first.episode();
    let model = first.model();
    let on = Recipe {
        flights: 32,
        ..Recipe::DEFAULT.going_on("a".to_owned())
    };
    let mut whole = Training::going_on(on.clone(), &flights, &model).unwrap();
    assert_eq!(whole.network.means[..], model.network.means[..]);
    whole.episode();
    let checkpoint = whole.checkpoint();
    whole.episode();
    let mut resumed = Training::going_on(on.clone(), &flights, &model)
        .unwrap()
        .resumed(&checkpoint)
        .unwrap();
    resumed.episode();
    assert_eq!(resumed.checkpoint(), whole.checkpoint());
    let after = whole.model();
    assert_ne!(after.network.means[..], model.network.means[..]);
    assert_eq!(after.normalisation, model.normalisation);
    assert_eq!(after.parameters.population, model.parameters.population);
    assert_eq!(after.parameters.hypotheses, Hypotheses::PAPER);
    // The one before may lie anywhere; what goes on ends on the grid, from means between that still move.
    let off_grid = |model: &RecursiveModel| {
        let errors = layer_errors(&model.weights(), &model.layers());
        errors.iter().map(|e| e.mean_max_steps).fold(0.0, f64::max)
    };
    assert!(off_grid(&model) > 0.4);
    assert!(off_grid(&after) < 1e-3);
    assert_ne!(whole.network.means[..], after.network.means[..]);
    let other = Recipe {
        from: Some("b".to_owned()),
        ..on
    };
    assert_eq!(
        Training::going_on(other, &flights, &model)
            .unwrap()
            .resumed(&checkpoint)
            .unwrap_err(),
        ResumeError::OtherRecipe
    );
}

#[test]
fn a_checkpoint_of_another_run_is_refused() {
    let flights = flights();
    let checkpoint = Training::new(recipe(), &flights).unwrap().checkpoint();
    let other = Recipe {
        seed: 9,
        ..recipe()
    };
    assert_eq!(
        Training::new(other, &flights)
            .unwrap()
            .resumed(&checkpoint)
            .unwrap_err(),
        ResumeError::OtherRecipe
    );
    assert_eq!(
        Training::new(recipe(), &flights[1..])
            .unwrap()
            .resumed(&checkpoint)
            .unwrap_err(),
        ResumeError::OtherFlights
    );
}

#[test]
fn settings_that_cannot_work_are_refused() {
    let bad = Recipe {
        flights: 40,
        ..recipe()
    };
    assert!(matches!(
        Training::new(bad, &flights()),
        Err(TrainingError::BatchSize {
            flights: 40,
            unit: 32
        })
    ));
    assert!(matches!(
        Training::new(recipe(), &[]),
        Err(TrainingError::NoFlights)
    ));
}
