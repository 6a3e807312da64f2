//! Tests that each table refuses values out of their ranges.

use super::*;

#[track_caller]
fn check(result: Result<(), ConfigError>, key: Option<&str>) {
    assert_eq!(result.err().map(|error| error.key), key);
}

#[test]
fn a_loss_without_weights_or_with_an_unreachable_margin_is_refused() {
    check(LossConfig::default().check(), None);
    check(
        LossConfig {
            push_weight: -1.0,
            ..LossConfig::default()
        }
        .check(),
        Some("loss.push_weight"),
    );
    check(
        LossConfig {
            pull_margin: f64::NAN,
            ..LossConfig::default()
        }
        .check(),
        Some("loss.pull_margin"),
    );
    check(
        LossConfig {
            push_margin: 1.5,
            ..LossConfig::default()
        }
        .check(),
        Some("loss.push_margin"),
    );
    check(
        LossConfig {
            temperature: 0.0,
            ..LossConfig::default()
        }
        .check(),
        Some("loss.temperature"),
    );
    let nothing = LossConfig {
        pull_weight: 0.0,
        push_weight: 0.0,
        proto_ce_weight: 0.0,
        ..LossConfig::default()
    };
    check(nothing.check(), Some("loss"));
}

#[test]
fn optimizer_and_augmentation_ranges_hold() {
    check(OptimConfig::default().check(), None);
    check(
        OptimConfig {
            learning_rate: 0.0,
            ..OptimConfig::default()
        }
        .check(),
        None,
    );
    check(
        OptimConfig {
            learning_rate: f64::INFINITY,
            ..OptimConfig::default()
        }
        .check(),
        Some("optim.learning_rate"),
    );
    check(
        OptimConfig {
            clip_norm: 0.0,
            ..OptimConfig::default()
        }
        .check(),
        Some("optim.clip_norm"),
    );
    let endless = ScheduleConfig::OneCycle {
        warmup_fraction: 1.0,
        div: 10.0,
        final_div: 1000.0,
    };
    check(
        OptimConfig {
            schedule: endless,
            ..OptimConfig::default()
        }
        .check(),
        Some("optim.schedule.warmup_fraction"),
    );
    let cosine = |warmup_fraction, final_fraction| OptimConfig {
        schedule: ScheduleConfig::Cosine {
            warmup_fraction,
            final_fraction,
        },
        ..OptimConfig::default()
    };
    check(cosine(0.0, 0.0).check(), None);
    check(
        cosine(-0.1, 0.0).check(),
        Some("optim.schedule.warmup_fraction"),
    );
    check(
        cosine(0.1, 1.5).check(),
        Some("optim.schedule.final_fraction"),
    );
    check(
        OptimConfig {
            block_lr_factor: f64::NAN,
            ..OptimConfig::default()
        }
        .check(),
        Some("optim.block_lr_factor"),
    );
    check(AugmentConfig::default().check(), None);
    check(
        AugmentConfig {
            scale: [1.2, 0.8],
            ..AugmentConfig::default()
        }
        .check(),
        Some("augment.scale"),
    );
    check(
        AugmentConfig {
            reflect_probability: 1.1,
            ..AugmentConfig::default()
        }
        .check(),
        Some("augment.reflect_probability"),
    );
}

#[test]
fn lengths_of_nothing_are_refused() {
    check(
        TokenConfig {
            train_tokens: 7.into(),
            ..TokenConfig::default()
        }
        .check(),
        Some("tokens.train_tokens"),
    );
    let settings = |steps, batch_shapes, accumulate| TrainSettings {
        train: TrainConfig {
            steps,
            batch_shapes,
            accumulate,
            ..TrainConfig::default()
        },
        ..TrainSettings::default()
    };
    check(settings(1, 2, 3).check(), None);
    check(settings(0, 2, 1).check(), Some("train.steps"));
    check(settings(1, 0, 1).check(), Some("train.batch_shapes"));
    check(settings(1, 2, 0).check(), Some("train.accumulate"));
}
