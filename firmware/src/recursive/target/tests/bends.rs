use super::*;

/// Where it goes straight on, where it was said to be, and the part of the bend between them that came true; what is open
/// of the part is open along the bend.
#[test]
fn a_bend_takes_a_part_of_what_was_said() {
    let before = target();
    let steady = Steady::of(&before.state);
    let mut said = before;
    for (value, by) in said
        .state
        .iter_mut()
        .zip([3.0, 1.0, -2.0, 2.0, 0.5, -1.0, 3.0, 0.0, 1.0])
    {
        *value += by;
    }
    said.foresight.followed = 0.2;
    said.foresight.bent = 1.0;
    let part = said.foresight.bend(0.6);
    assert!((part - 0.4).abs() < 1e-6);
    let straight_m = steady.after(2.0);
    for kept_mps2 in [[0.0; 3], said.acceleration()] {
        let mut got = said;
        got.bend((&steady, 2.0), kept_mps2, 0.6, 0.5);
        let steady: [f32; 9] = core::array::from_fn(|i| match i / 3 {
            0 => straight_m[i],
            1 => before.state[i],
            _ => kept_mps2[i - 6],
        });
        let bent: [f32; 9] = core::array::from_fn(|i| said.state[i] - steady[i]);
        for i in 0..9 {
            assert!((got.state[i] - (steady[i] + 0.4 * bent[i])).abs() < 1e-4);
            for j in 0..9 {
                let open = 0.5 * 0.15 * bent[i] * bent[j];
                let added = got.covariance[i][j] - said.covariance[i][j];
                assert!((added - open).abs() < 1e-4 * open.abs().max(1.0), "{i} {j}");
            }
        }
    }
    // Nothing is open of the first second of a forecast, and all of it comes true if nothing was learned.
    let mut same = target();
    let (state, covariance) = (same.state, same.covariance);
    same.bend((&Steady::of(&state), 0.0), [0.0; 3], 1.0, 0.0);
    assert_eq!((same.state, same.covariance), (state, covariance));
}

/// A gap is the network's own for a second; what comes later bends, and what is open of that grows with the square of
/// the time since.
#[test]
fn a_gap_bends_after_a_second() {
    let schedule = Schedule::wide(&base());
    for (coast_s, dt_s, open) in [(0.0, 0.2, None), (0.9, 0.2, None), (1.5, 0.2, Some(6.0))] {
        let mut before = target();
        before.memory.coast_s = coast_s;
        (before.foresight.followed, before.foresight.bent) = (1.0, 4.0);
        let (mut gone, mut expected) = (before, before);
        let sight = before.sight();
        gone.go_on(&sight, &schedule, dt_s, 0.5);
        expected.predict(&sight, &schedule, dt_s);
        if let Some(open) = open {
            let kept_mps2 = expected.acceleration();
            expected.bend((&Steady::of(&before.state), dt_s), kept_mps2, 0.5, open);
        }
        for i in 0..9 {
            assert!(
                (gone.state[i] - expected.state[i]).abs() < 1e-6,
                "{coast_s} {i}"
            );
            for j in 0..9 {
                let (a, b) = (gone.covariance[i][j], expected.covariance[i][j]);
                assert!(
                    (a - b).abs() <= 1e-5 * b.abs().max(1e-3),
                    "{coast_s} {i} {j}"
                );
            }
        }
    }
}
