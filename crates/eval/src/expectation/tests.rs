use super::*;
use crate::tables::tables;
use crate::tables::tests::{example, settings};
use std::collections::BTreeMap;

fn trainings() -> TrainingFigures {
    TrainingFigures {
        untouched_tensors: BTreeMap::from([("step-parts".to_owned(), 3)]),
    }
}

#[test]
fn tensors_that_no_gradient_reached_are_bounded() {
    let key = "step-parts.untouched_tensors";
    check(
        key,
        "<= 0",
        false,
        "missed: step-parts.untouched_tensors <= 0 (it is 3.0000)",
    );
    check(
        key,
        "< 4",
        true,
        "holds: step-parts.untouched_tensors < 4 (it is 3.0000)",
    );
    check_refused(
        "brep-face.untouched_tensors",
        "<= 0",
        "but this run has no value",
    );
    let bounds = Expectations::parse([(key, "<= 0")]).unwrap();
    assert!(
        bounds.check_names(&["step-parts"], &[]).is_ok()
            && bounds.check_names(&["a"], &[]).is_err()
    );
}

#[test]
fn bounds_about_a_missing_supervision_are_taken_out() {
    let difference = "step-parts/step-parts.miou - ward-20/step-parts.miou";
    let alone = "step-parts/step-parts.miou";
    let bounds = Expectations::parse([(difference, ">= 0.1"), (alone, ">= 0.2")]).unwrap();
    let (others, taken) = bounds.clone().without(&["ward-20"]);
    assert_eq!(others, Expectations::parse([(alone, ">= 0.2")]).unwrap());
    assert_eq!(taken, [format!("{difference} >= 0.1")]);
    assert_eq!(bounds.clone().without(&[]), (bounds, Vec::new()));
}

#[track_caller]
fn check(key: &str, bound: &str, passed: bool, shown: &str) {
    let tables = tables(&example(), &settings());
    let outcomes = Expectations::parse([(key, bound)])
        .unwrap()
        .evaluate(&tables, &trainings())
        .unwrap();
    assert_eq!(
        outcomes
            .iter()
            .map(|outcome| outcome.passed)
            .collect::<Vec<_>>(),
        [passed]
    );
    assert_eq!(outcomes[0].to_string(), shown);
}

#[test]
fn scores_and_differences_are_bounded() {
    let key = "step-parts/step-parts.miou";
    check(
        key,
        ">= 0.625",
        true,
        "holds: step-parts/step-parts.miou >= 0.625 (it is 0.6250)",
    );
    check(
        key,
        ">0.625",
        false,
        "missed: step-parts/step-parts.miou > 0.625 (it is 0.6250)",
    );
    check(
        key,
        " <= 0.7",
        true,
        "holds: step-parts/step-parts.miou <= 0.7 (it is 0.6250)",
    );
    check(
        key,
        "< 0.5",
        false,
        "missed: step-parts/step-parts.miou < 0.5 (it is 0.6250)",
    );
    let key = "step-parts/step-parts.miou - untrained/step-parts@k-means.miou";
    check(
        key,
        ">= 0.4",
        false,
        &format!("missed: {key} >= 0.4 (it is 0.3750)"),
    );
    let key = "brep-face/step-parts.accuracy - no-network/step-parts.accuracy";
    check(
        key,
        "> -1",
        true,
        &format!("holds: {key} > -1 (it is 0.1250)"),
    );
}

#[track_caller]
fn check_refused(key: &str, bound: &str, message: &str) {
    let tables = tables(&example(), &settings());
    let error = Expectations::parse([(key, bound)])
        .and_then(|bounds| bounds.evaluate(&tables, &trainings()))
        .unwrap_err();
    assert!(
        error.to_string().contains(message) && error.to_string().contains(key),
        "{error}"
    );
}

#[test]
fn what_cannot_be_decided_is_refused_by_its_key() {
    for key in [
        "",
        "miou",
        "a/b",
        "a.miou",
        "/b.miou",
        "a/.miou",
        "A/b.miou",
        "a/b@.miou",
        "a/b.miou - ",
        "a/b.miou - c",
    ] {
        check_refused(key, ">= 0", "does not name a score");
    }
    check_refused(
        "a/b.iou",
        ">= 0",
        "ends with `iou`, which is not a metric; the metrics are miou, accuracy",
    );
    for bound in ["", "0.5", "= 0.5", "=> 0.5", ">= x", ">= NaN", ">= inf"] {
        check_refused("a/b.miou", bound, "write >=, >, <= or < and a number");
    }
    check_refused(
        "a/step-parts.miou",
        ">= 0",
        "this run does not have; it has step-parts/step-parts@k-means",
    );
    check_refused(
        "step-parts/step-parts@ward.miou",
        ">= 0",
        "step-parts/step-parts@ward",
    );
    check_refused(
        "no-network/step-parts.gtc_miou",
        ">= 0",
        "no-network/step-parts.gtc_miou`, but this run has no value",
    );
}

#[test]
fn names_can_be_checked_before_any_work() {
    let bounds = Expectations::parse([("a/b.miou - c/b.miou", ">= 0")]).unwrap();
    assert_eq!(bounds.check_names(&["a", "c"], &["b"]), Ok(()));
    let error = bounds.check_names(&["a"], &["b"]).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("names `c`, which this run does not have; it has a"),
        "{error}"
    );
    assert!(bounds.check_names(&["a", "c"], &["x", "y"]).is_err());
}
