use super::*;
use crate::config::OptimConfig;
use crate::config::Voxels;
use crate::data::shape_order::batch;
use crate::data::tokens::{TokenizeError, tokenize};
use crate::model::layers::NormKind;
use crate::model::net_config::NetConfig;
use crate::testing::{boxes, net, net_with, settings};
use std::ops::ControlFlow;

fn step(training: &mut Training, shapes: &[TrainShape]) -> Result<StepReport, TrainError> {
    let batch = training.load(shapes)?;
    training.step(&batch)
}

fn train(shapes: &[TrainShape], settings: &TrainSettings, n_threads: usize) -> Training {
    let mut training = Training::new(&net(), settings, Backend::Flex)
        .unwrap()
        .with_threads(n_threads)
        .unwrap();
    while !training.is_done() {
        step(&mut training, shapes).unwrap();
    }
    training
}

/// The fraction of tokens that are nearest to the mean direction of their own label.
fn nearest_center_accuracy(model: &Model, shape: &TrainShape) -> f64 {
    let tokens = tokenize(&shape.sample, 60, Voxels::NormalKeyed).unwrap();
    let labels = tokens.majority_labels(&shape.labels);
    let embeddings = model.embed(&tokens).unwrap();
    let mut centers = vec![vec![0.0f32; embeddings.dim()]; 6];
    for (row, &label) in embeddings.rows().zip(&labels) {
        centers[label as usize]
            .iter_mut()
            .zip(row)
            .for_each(|(sum, x)| *sum += x);
    }
    let cosine = |row: &[f32], center: &[f32]| {
        let norm = center.iter().map(|x| x * x).sum::<f32>().sqrt();
        row.iter().zip(center).map(|(x, y)| x * y).sum::<f32>() / norm
    };
    let hits = embeddings.rows().zip(&labels).filter(|(row, label)| {
        (0..6).all(|other| cosine(row, &centers[other]) <= cosine(row, &centers[**label as usize]))
    });
    hits.count() as f64 / labels.len() as f64
}

#[test]
fn training_lowers_the_loss_and_beats_the_untrained_network() {
    let (shapes, settings) = (boxes(), settings(40));
    let mut training = Training::new(&net(), &settings, Backend::Flex).unwrap();
    let accuracy = |model: &Model| {
        shapes
            .iter()
            .map(|shape| nearest_center_accuracy(model, shape))
            .sum::<f64>()
            / 4.0
    };
    let untrained = accuracy(training.model());
    let mut losses = Vec::new();
    while !training.is_done() {
        losses.push(step(&mut training, &shapes).unwrap().loss.total);
    }
    let mean = |losses: &[f64]| losses.iter().sum::<f64>() / losses.len() as f64;
    assert!(mean(&losses[30..]) < 0.5 * mean(&losses[..5]), "{losses:?}");
    let trained = accuracy(training.model());
    assert!(
        trained > 0.9 && trained > untrained + 0.1,
        "{trained} after {untrained}"
    );
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let mut settings = settings(3);
    settings.train.batch_shapes = 3;
    let bytes = |n_threads| train(&boxes(), &settings, n_threads).checkpoint().unwrap();
    let alone = bytes(1);
    assert_eq!(bytes(2), alone);
    assert_eq!(bytes(4), alone);
}

#[test]
fn a_resumed_training_ends_with_the_same_bytes() {
    let (shapes, settings) = (boxes(), settings(6));
    let through = train(&shapes, &settings, 1).checkpoint().unwrap();
    let mut first = Training::new(&net(), &settings, Backend::Flex).unwrap();
    for _ in 0..3 {
        step(&mut first, &shapes).unwrap();
    }
    let mut second = Training::resume(&first.checkpoint().unwrap(), Backend::Flex).unwrap();
    assert_eq!(second.n_steps_done(), 3);
    assert_eq!((second.settings(), second.data()), (&settings, None));
    let noted = second.checkpoint().unwrap();
    second = Training::resume(&noted, Backend::Flex)
        .unwrap()
        .with_data("four boxes".to_owned());
    second = Training::resume(&second.checkpoint().unwrap(), Backend::Flex).unwrap();
    assert_eq!(second.data(), Some("four boxes"));
    second = Training::resume(&noted, Backend::Flex).unwrap();
    while !second.is_done() {
        step(&mut second, &shapes).unwrap();
    }
    assert_eq!(second.checkpoint().unwrap(), through);
}

#[test]
fn the_order_and_the_initial_weights_do_not_depend_on_labels() {
    let shapes = boxes();
    let mut relabeled = shapes.clone();
    relabeled
        .iter_mut()
        .for_each(|shape| shape.labels.iter_mut().for_each(|label| *label /= 2));
    let batches = |shapes: &[TrainShape]| {
        let mut training = Training::new(&net(), &settings(4), Backend::Flex).unwrap();
        let initial = training.model().to_safetensors().unwrap();
        let reports: Vec<_> = (0..4)
            .map(|_| step(&mut training, shapes).unwrap())
            .collect();
        let chosen: Vec<Vec<String>> = reports.iter().map(|report| report.shapes.clone()).collect();
        (initial, chosen, reports[3].loss.total)
    };
    let (mine, other) = (batches(&shapes), batches(&relabeled));
    assert_eq!((mine.0, mine.1), (other.0, other.1));
    assert_ne!(mine.2, other.2);
}

#[test]
fn without_a_learning_rate_nothing_is_learned() {
    let mut settings = settings(2);
    settings.optim = OptimConfig {
        learning_rate: 0.0,
        ..settings.optim
    };
    let before = Training::new(&net(), &settings, Backend::Flex)
        .unwrap()
        .model()
        .to_safetensors()
        .unwrap();
    assert_eq!(
        train(&boxes(), &settings, 1)
            .model()
            .to_safetensors()
            .unwrap(),
        before
    );
}

#[test]
fn a_shape_that_is_not_finite_is_named_and_changes_nothing() {
    let mut shapes = boxes();
    shapes
        .iter_mut()
        .for_each(|shape| shape.sample.points[7][1] = f32::NAN);
    let mut training = Training::new(&net(), &settings(2), Backend::Flex).unwrap();
    let before = training.checkpoint().unwrap();
    let first = batch(5, 4, 2, 0)[0];
    let expected = TrainError::NonFinite {
        shape: shapes[first].id.clone(),
        step: 1,
    };
    assert_eq!(step(&mut training, &shapes), Err(expected));
    assert_eq!(training.checkpoint().unwrap(), before);
}

#[test]
fn what_cannot_be_trained_on_is_refused() {
    let mut training = Training::new(&net(), &settings(2), Backend::Flex).unwrap();
    assert_eq!(step(&mut training, &[]), Err(TrainError::NoShapes));
    let short = TrainShape {
        labels: vec![0; 3],
        ..boxes().remove(0)
    };
    let expected = TrainError::Labels {
        shape: short.id.clone(),
        n_labels: 3,
        n_points: 900,
    };
    assert_eq!(step(&mut training, &[short]), Err(expected));
    let empty = TrainShape {
        id: "empty".to_owned(),
        sample: PointSample::default(),
        labels: vec![],
    };
    let expected = TrainError::Tokens {
        shape: "empty".to_owned(),
        problem: TokenizeError::Empty,
    };
    assert_eq!(step(&mut training, &[empty]), Err(expected));
    let mut never = settings(2);
    never.train.batch_shapes = 0;
    assert!(matches!(
        Training::new(&net(), &never, Backend::Flex),
        Err(TrainError::Config(_))
    ));
}

#[test]
fn a_shape_of_one_part_has_no_loss_and_is_counted() {
    let mut shapes = boxes();
    shapes.iter_mut().for_each(|shape| shape.labels.fill(3));
    let mut training = Training::new(&net(), &settings(2), Backend::Flex).unwrap();
    let report = step(&mut training, &shapes).unwrap();
    assert_eq!(
        (report.n_without_loss, report.loss.total, report.grad_norm),
        (2, 0.0, 0.0)
    );
}

/// A network with batch norms and dropped paths, which differ between training and test time.
fn stochastic_net() -> NetConfig {
    net_with(|ptv3| (ptv3.norm, ptv3.drop_path) = (NormKind::Batch, 0.2))
}

#[test]
fn a_batch_that_runs_as_one_resumes_to_the_same_bytes_for_any_number_of_threads() {
    let (shapes, mut settings) = (boxes(), settings(4));
    settings.train.batch_shapes = 3;
    let start = || Training::new(&stochastic_net(), &settings, Backend::Flex).unwrap();
    let finish = |mut training: Training| {
        while !training.is_done() {
            step(&mut training, &shapes).unwrap();
        }
        training.checkpoint().unwrap()
    };
    let through = finish(start());
    assert_eq!(finish(start().with_threads(3).unwrap()), through);
    let mut first = start();
    step(&mut first, &shapes).unwrap();
    step(&mut first, &shapes).unwrap();
    assert_eq!(
        finish(Training::resume(&first.checkpoint().unwrap(), Backend::Flex).unwrap()),
        through
    );
}

#[test]
fn a_batch_that_runs_as_one_learns_and_counts_statistics_that_do_not_decay() {
    let (shapes, settings) = (boxes(), settings(40));
    let net = net_with(|ptv3| ptv3.norm = NormKind::Batch);
    let mut training = Training::new(&net, &settings, Backend::Flex).unwrap();
    let losses: Vec<f64> = (0..40)
        .map(|_| step(&mut training, &shapes).unwrap().loss.total)
        .collect();
    let mean = |losses: &[f64]| losses.iter().sum::<f64>() / losses.len() as f64;
    assert!(mean(&losses[30..]) < 0.6 * mean(&losses[..5]), "{losses:?}");
    let mut values = training.values.as_slice();
    for shape in parameters::shapes(training.model().network()) {
        let (own, rest) = values.split_at(shape.len());
        values = rest;
        if shape.name.ends_with("running_variance") {
            // At least 0.99^40 of the initial value 1 is left.
            assert!(
                own.iter().all(|&variance| variance > 0.66),
                "{}: {own:?}",
                shape.name
            );
            assert!(own.iter().any(|&variance| variance != 1.0));
        }
    }
    assert_eq!(training.untouched_tensors(), [] as [&str; 0]);
}

#[test]
fn shapes_of_one_batch_influence_each_other_only_through_batch_norms() {
    let (shapes, mut settings) = (boxes(), settings(1));
    let loss = |net: &NetConfig, settings: &TrainSettings| {
        let training = Training::new(net, settings, Backend::Flex).unwrap();
        let batch = training.load(&shapes).unwrap();
        let mut gradient = Gradient::zero(&training);
        gradient.accumulate(&training, &batch).unwrap();
        gradient.losses[0]
    };
    let batch_net = net_with(|ptv3| ptv3.norm = NormKind::Batch);
    let of = |batch_shapes: usize, net: &NetConfig, settings: &mut TrainSettings| {
        settings.train.batch_shapes = batch_shapes;
        loss(net, settings)
    };
    assert_eq!(of(1, &net(), &mut settings), of(3, &net(), &mut settings));
    assert_ne!(
        of(1, &batch_net, &mut settings),
        of(3, &batch_net, &mut settings)
    );
}

#[test]
fn dropped_paths_change_the_gradient_but_neither_poses_nor_initial_weights() {
    let shapes = boxes();
    let run = |drop_path: f64| {
        let net = net_with(|ptv3| ptv3.drop_path = drop_path);
        let mut training = Training::new(&net, &settings(1), Backend::Flex).unwrap();
        let initial = training.values.clone();
        let labels: Vec<Vec<i32>> = training
            .load(&shapes)
            .unwrap()
            .into_iter()
            .map(|shape| shape.labels)
            .collect();
        let report = step(&mut training, &shapes).unwrap();
        (initial, labels, report.loss.total)
    };
    let (with, without) = (run(0.5), run(0.0));
    assert_eq!((&with.0, &with.1), (&without.0, &without.1));
    assert_ne!(with.2, without.2);
    assert_eq!(run(0.5).2, with.2);
}

#[test]
fn accumulated_batches_are_one_larger_batch() {
    let shapes = boxes();
    let weights = |batch_shapes, accumulate| {
        let mut settings = settings(3);
        (settings.train.batch_shapes, settings.train.accumulate) = (batch_shapes, accumulate);
        train(&shapes, &settings, 2)
            .model()
            .to_safetensors()
            .unwrap()
    };
    let whole = weights(4, 1);
    assert_eq!(weights(2, 2), whole);
    assert_eq!(weights(1, 4), whole);
    assert_ne!(weights(2, 1), whole);
}

#[test]
fn shapes_of_different_sizes_share_a_batch() {
    let shapes = [30, 400, 2000].map(|n_points| crate::testing::labeled_box(1.0, n_points));
    let mut settings = settings(2);
    settings.train.batch_shapes = 3;
    let mut training = Training::new(&net(), &settings, Backend::Flex).unwrap();
    let report = step(&mut training, &shapes).unwrap();
    assert!(report.loss.total > 0.0 && report.n_without_loss == 0);
}

/// Ends a training after a number of updates.
struct StopAfter(usize);

impl Observer for StopAfter {
    type Error = TrainError;

    fn after_step(
        &mut self,
        training: &Training,
        report: &StepReport,
    ) -> Result<ControlFlow<()>, TrainError> {
        assert_eq!(report.step, training.n_steps_done());
        Ok(if report.step >= self.0 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        })
    }
}

/// A training of at most `n_steps` updates by [`fit`], with a fault if one is given.
fn fitted(
    shapes: &[TrainShape],
    settings: &TrainSettings,
    n_steps: usize,
    fault: Option<Fault>,
) -> Training {
    let mut training = Training::new(&net(), settings, Backend::Flex).unwrap();
    let mut batches = training.batches_of(shapes);
    let mut observer = StopAfter(n_steps);
    match fault {
        None => fit(&mut training, &mut batches, &mut observer).unwrap(),
        Some(fault) => {
            let (mut batches, mut observer) = (
                FaultInjection::new(&mut batches, fault),
                FaultInjection::new(&mut observer, fault),
            );
            fit(&mut training, &mut batches, &mut observer).unwrap();
        }
    }
    training
}

#[test]
fn fit_makes_the_same_updates_as_single_steps_and_stops_on_request() {
    let shapes = boxes();
    for accumulate in [1, 2] {
        let mut settings = settings(4);
        settings.train.accumulate = accumulate;
        let stepwise = train(&shapes, &settings, 1);
        assert_eq!(
            fitted(&shapes, &settings, 9, None).checkpoint().unwrap(),
            stepwise.checkpoint().unwrap()
        );
        assert_eq!(fitted(&shapes, &settings, 3, None).n_steps_done(), 3);
    }
}

#[test]
fn a_faulty_training_is_distinguished_from_a_correct_one() {
    let (shapes, settings) = (boxes(), settings(2));
    let trained = |fault| fitted(&shapes, &settings, 2, fault);
    let sound = trained(None);
    assert_eq!(sound.untouched_tensors(), [] as [&str; 0]);

    let n_tensors = parameters::shapes(sound.model().network()).len();
    for (fault, n_untouched) in [
        (Fault::FlipLoss, 0..=0),
        (Fault::ShuffleLabels, 0..=0),
        (Fault::FreezeEncoder, n_tensors - 2..=n_tensors - 2),
        (Fault::ZeroBlockGradient, 1..=n_tensors / 2),
    ] {
        let faulty = trained(Some(fault));
        assert_ne!(faulty.values, sound.values, "{fault:?}");
        assert!(
            n_untouched.contains(&faulty.untouched_tensors().len()),
            "{fault:?}"
        );
    }
}
