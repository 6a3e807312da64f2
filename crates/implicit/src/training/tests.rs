//! Tests gradients against finite differences, determinism, and the influence of the segmentation loss.

use super::*;
use crate::fixtures::torus;
use crate::geometry::{PoolSizes, Reference};
use crate::network::Trunk;
use crate::training::{Mode, SegGrad};

const SIZES: PoolSizes = PoolSizes {
    surface: 400,
    near: 400,
    uniform: 400,
};

fn pools() -> Pools {
    Pools::new(
        &Reference::new(&torus([1.0, 0.4], [40, 20])).unwrap(),
        SIZES,
        "torus",
    )
    .unwrap()
}

/// Four quarters of the torus as labels 0 to 3. Every eleventh point has no label.
fn labels(pools: &Pools) -> PointLabels {
    let quarter = |(idx, position): (usize, &[f32; 3])| {
        let quarter = i32::from(position[0] > 0.0) + 2 * i32::from(position[1] > 0.2);
        if idx % 11 == 0 { -1 } else { quarter }
    };
    let of_point = pools
        .surface
        .positions
        .iter()
        .enumerate()
        .map(quarter)
        .collect();
    PointLabels::new(of_point, pools).unwrap()
}

fn settings(mode: Mode, trunk: Trunk) -> Settings {
    Settings {
        trunk,
        points: [96, 96, 192],
        iterations: 40,
        ..Settings::of_mode(mode)
    }
}

/// The sum of the weighted losses and the gradient, on the points of the first update, with these parameters.
fn loss_and_gradient(training: &mut Training<'_>, parameters: &[f32]) -> (f64, Vec<f32>) {
    training.rng = keyed_rng(5, &["test"]);
    training
        .prepared
        .update(|own| own.copy_from_slice(parameters));
    let losses = training.add_up();
    let factors = training.factors();
    let means = factors.means;
    let total = losses.surface * factors.surface / means.surface
        + losses.off_surface * factors.off_surface / means.off_surface
        + losses.normal * factors.normal / means.surface
        + losses.eikonal * factors.eikonal / means.eikonal
        + losses.off_diagonal * factors.off_diagonal / means.near
        + losses.segmentation * factors.segmentation / means.surface;
    (total, training.gradient.clone())
}

/// The gradient along random directions must be the difference of two losses.
#[track_caller]
fn check_gradient(mode: Mode, trunk: Trunk) {
    let pools = pools();
    let labels = labels(&pools);
    let settings = Settings {
        segmentation_weight: 20.0,
        ..settings(mode, trunk)
    };
    let mut training = Training::new(&pools, Some(&labels), &settings, 3);
    // A few updates are made first, because some derivatives are 0 at the initial weights.
    for _ in 0..5 {
        training.update();
    }
    if mode == Mode::FlatCad {
        // The off-diagonal loss treats its tangents as constants, but a difference does not. At the end, its weight is 0.
        training.n_updates = settings.iterations;
    }
    let layout = training.network.layout();
    let parameters = training.prepared.parameters().to_vec();
    let (_, gradient) = loss_and_gradient(&mut training, &parameters);
    let groups = (0..5)
        .flat_map(|layer| [layout.weights(layer), layout.biases(layer)])
        .chain([
            layout.output_weights(),
            layout.head_weights(),
            layout.head_biases(),
        ])
        .chain([layout.label_weights(), layout.label_biases()]);
    for (idx, group) in groups.enumerate() {
        let direction = &gradient[group.clone()];
        let norm = direction
            .iter()
            .map(|&g| f64::from(g).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!(norm > 0.0, "group {idx} has no gradient");
        // The step is along the gradient itself, so that the difference is large compared with its rounding error.
        let moved = |step: f64| {
            let mut moved = parameters.clone();
            for (x, &g) in moved[group.clone()].iter_mut().zip(direction) {
                *x += (step * f64::from(g) / norm) as f32;
            }
            moved
        };
        // The step is small compared with the period of the sines and the kinks of the losses, and large compared with rounding
        // errors.
        let step = match mode {
            _ if idx >= 11 => 2e-3,
            Mode::OracleSdf => 5e-5,
            Mode::FlatCad => 5e-6,
        };
        let (high, _) = loss_and_gradient(&mut training, &moved(step));
        let (low, _) = loss_and_gradient(&mut training, &moved(-step));
        let found = (high - low) / (2.0 * step);
        // If a point crosses the kink of an absolute value, the difference is not the derivative.
        assert!(
            (found / norm - 1.0).abs() < 0.05,
            "{mode:?} {trunk} group {idx}: {found} {norm}"
        );
    }
}

#[test]
fn gradients_are_those_of_finite_differences() {
    check_gradient(Mode::OracleSdf, Trunk::Siren64x4);
    check_gradient(Mode::OracleSdf, Trunk::Softplus128x4);
    check_gradient(Mode::FlatCad, Trunk::Siren64x4);
}

/// The tangents of the off-diagonal loss do not change when the output is scaled.
#[test]
fn the_off_diagonal_loss_grows_with_the_output() {
    let pools = pools();
    let settings = settings(Mode::FlatCad, Trunk::Siren64x4);
    let mut training = Training::new(&pools, None, &settings, 3);
    let layout = training.network.layout();
    let parameters = training.prepared.parameters().to_vec();
    let mut scaled = |factor: f32| {
        let mut scaled = parameters.clone();
        scaled[layout.output_weights()]
            .iter_mut()
            .for_each(|x| *x *= factor);
        loss_and_gradient(&mut training, &scaled)
    };
    let (_, gradient) = scaled(1.0);
    let expected: f64 = layout
        .output_weights()
        .map(|at| f64::from(gradient[at]) * f64::from(parameters[at]))
        .sum();
    let [high, low] = [1.001, 0.999].map(|factor| scaled(factor).0);
    let found = (high - low) / 0.002;
    assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
}

#[test]
fn the_gradient_by_the_position_is_that_of_finite_differences() {
    for trunk in Trunk::ALL {
        let network = Network::new(trunk, 0, 1);
        let positions: Vec<[f32; 3]> = pools().near.positions[..200].to_vec();
        let found = network.distances_and_gradients(&positions);
        assert_eq!(
            network.distances(&positions),
            found.iter().map(|f| f.0).collect::<Vec<_>>()
        );
        const STEP: f32 = 1e-3;
        for axis in 0..3 {
            let moved = |step: f32| {
                let mut moved = positions.clone();
                moved.iter_mut().for_each(|position| position[axis] += step);
                network.distances(&moved)
            };
            for ((high, low), (_, gradient)) in moved(STEP).iter().zip(moved(-STEP)).zip(&found) {
                let expected = (high - low) / (2.0 * STEP);
                assert!(
                    (gradient[axis] - expected).abs() < 0.02 * (1.0 + expected.abs()),
                    "{trunk}: {gradient:?} {expected}"
                );
            }
        }
    }
}

fn trained(
    labels: Option<&PointLabels>,
    pools: &Pools,
    settings: &Settings,
    threads: usize,
) -> (Network, Losses) {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| {
        let mut training = Training::new(pools, labels, settings, 7);
        let mut losses = Losses::default();
        while training.n_updates() < settings.iterations {
            losses = training.update();
        }
        (training.finish(), losses)
    })
}

#[test]
fn the_number_of_threads_does_not_change_a_bit() {
    let pools = pools();
    let labels = labels(&pools);
    for mode in [Mode::OracleSdf, Mode::FlatCad] {
        let settings = Settings {
            iterations: 3,
            ..settings(mode, Trunk::Siren64x4)
        };
        assert_eq!(
            trained(Some(&labels), &pools, &settings, 1),
            trained(Some(&labels), &pools, &settings, 5)
        );
    }
}

#[test]
fn a_stopped_gradient_leaves_the_trunk_of_the_control() {
    let pools = pools();
    let labels = labels(&pools);
    let settings = settings(Mode::OracleSdf, Trunk::Siren64x4);
    let stopped = Settings {
        seg_grad: SegGrad::Stop,
        ..settings.clone()
    };
    let (control, of_control) = trained(None, &pools, &settings, 2);
    let (stopped, of_stopped) = trained(Some(&labels), &pools, &stopped, 2);
    let (joint, _) = trained(Some(&labels), &pools, &settings, 2);
    assert_eq!(control.trunk_parameters(), stopped.trunk_parameters());
    assert_ne!(control.trunk_parameters(), joint.trunk_parameters());
    assert_eq!(
        of_control,
        Losses {
            segmentation: 0.0,
            ..of_stopped
        }
    );
    assert!(of_stopped.segmentation > 0.0);
}

#[test]
fn all_losses_fall() {
    let pools = pools();
    let labels = labels(&pools);
    let settings = Settings {
        iterations: 250,
        ..settings(Mode::OracleSdf, Trunk::Siren64x4)
    };
    let mut training = Training::new(&pools, Some(&labels), &settings, 1);
    let first = training.update();
    let mut last = first;
    while training.n_updates() < settings.iterations {
        last = training.update();
    }
    assert!(
        last.surface < 0.01 && last.surface < 0.3 * first.surface,
        "{first:?} {last:?}"
    );
    assert!(
        last.off_surface < 0.3 * first.off_surface,
        "{first:?} {last:?}"
    );
    assert!(last.normal < 0.1 * first.normal, "{first:?} {last:?}");
    assert!(
        last.segmentation < 0.2 * first.segmentation,
        "{first:?} {last:?}"
    );
}

#[test]
fn labels_that_cannot_supervise_are_refused() {
    let pools = pools();
    let message = |labels: Vec<i32>| PointLabels::new(labels, &pools).unwrap_err();
    assert_eq!(
        message(vec![0; 3]),
        LabelError::Length {
            n_labels: 3,
            n_points: 400
        }
    );
    assert_eq!(message(vec![-1; 400]), LabelError::Nothing);
    let mut uneven = vec![2; 400];
    uneven[0] = 0;
    let labels = PointLabels::new(uneven, &pools).unwrap();
    let mean: f32 = (0..400)
        .map(|point| labels.weight(labels.of_point(point)))
        .sum::<f32>()
        / 400.0;
    assert!((mean - 1.0).abs() < 1e-5 && labels.n_labels() == 3);
    assert!(labels.weight(0) > 10.0 * labels.weight(2) && labels.weight(1) == 0.0);
}
