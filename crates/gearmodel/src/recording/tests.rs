//! What a recording takes, refuses and gives back.

use super::*;

fn ramp() -> Columns<'static> {
    let time_s: Vec<f64> = (0..1000).map(|i| f64::from(i) * 0.01).collect();
    Columns {
        theta1_rad: time_s.clone().into(),
        theta2_rad: time_s.iter().map(|t| t + 0.1).collect(),
        time_s: time_s.into(),
        load_nm: 10.0.into(),
        speed_rpm: 5.0.into(),
        direction: Some(Direction::Ccw),
        input_lines: None,
        output_lines: None,
    }
}

fn with(values: &[f64], index: usize, value: f64) -> Cow<'static, [f64]> {
    let mut changed = values.to_vec();
    changed[index] = value;
    changed.into()
}

#[test]
fn faults_are_named_by_field_index_and_limit() {
    type Change = fn(&mut Columns<'static>);
    let cases: [(Change, &str); 11] = [
        (|c| c.time_s = with(&c.time_s, 3, f64::NAN), "time_s[3] is NaN"),
        (|c| c.time_s = with(&c.time_s, 3, 0.02), "time_s[3] = 0.02 s does not follow time_s[2] = 0.02 s"),
        (|c| c.theta1_rad = with(&c.theta1_rad, 999, f64::INFINITY), "theta1_rad[999] is inf"),
        (|c| c.theta2_rad = vec![1.0].into(), "theta2_rad has 1 values, time_s has 1000"),
        (|c| c.theta2_rad = vec![f64::NAN; 1000].into(), "theta2_rad holds no number"),
        (|c| c.load_nm = f64::NAN.into(), "load_nm is NaN"),
        (|c| c.speed_rpm = Condition::Each(vec![0.0].into()), "speed_rpm has 1 values"),
        (|c| c.speed_rpm = Condition::Each(with(&c.time_s, 7, f64::NAN)), "speed_rpm[7] is NaN"),
        (|c| c.direction = Some(Direction::Cw), "theta1_rad moves by 9.990000 rad, but direction is \"cw\""),
        (|c| c.output_lines = Some(0), "output_lines is 0"),
        (|c| c.time_s = vec![].into(), "time_s is empty"),
    ];
    for (change, text) in cases {
        let mut columns = ramp();
        change(&mut columns);
        let error = Recording::new(columns).unwrap_err().to_string();
        assert!(error.starts_with(text), "{error} does not start with {text}");
    }
    assert!(parse_direction("left").unwrap_err().to_string().contains("\"left\""));
    assert_eq!(parse_direction("auto"), Ok(None));
    assert_eq!(parse_direction("cw"), Ok(Some(Direction::Cw)));
}

#[test]
fn a_log_is_believed_in_clock_and_sense_but_not_in_shape() {
    let mut columns = ramp();
    columns.time_s = with(&columns.time_s, 3, 0.0);
    columns.direction = Some(Direction::Cw);
    assert!(Recording::new(columns.clone()).is_err());
    assert!(Recording::of_log(columns.clone()).is_ok());
    columns.theta1_rad = vec![0.0].into();
    assert!(matches!(Recording::of_log(columns), Err(RecordingError::Length { field: "theta1_rad", .. })));
}

#[test]
fn gaps_are_skipped_and_counted() {
    let mut columns = ramp();
    columns.theta1_rad = with(&columns.theta1_rad, 0, f64::NAN);
    columns.theta2_rad = with(&columns.theta2_rad, 500, f64::NAN);
    let recording = Recording::new(columns).unwrap();
    let pair = GearPair::constant(1.0).unwrap();
    let run = recording.te(&pair, AngleGrid::default()).unwrap();
    assert_eq!((run.samples(), run.rejected()), (998, 2));
    assert!((run.mean_curve().mean_rad() - 0.1).abs() < 1e-12);
    assert!((recording.turns() - 9.98 / TAU).abs() < 1e-12);
    assert!((recording.duration_s() - 9.99).abs() < 1e-12);
}

#[test]
fn a_swing_is_cut_at_its_turning_points_and_each_part_keeps_its_columns() {
    let mut columns = ramp();
    columns.theta1_rad = columns.time_s.iter().map(|t| t.sin()).collect();
    columns.theta2_rad = columns.theta1_rad.clone();
    columns.load_nm = Condition::Each(columns.time_s.clone());
    columns.direction = None;
    columns.input_lines = Some(9);
    let recording = Recording::new(columns).unwrap();
    assert_eq!(recording.one_sense(), Err(RecordingError::Reverses { reversals: 3, index: 157 }));
    let parts = recording.split();
    assert_eq!(parts.iter().map(Recording::samples).sum::<usize>(), 1000);
    let senses: Vec<_> = parts.iter().map(|part| part.one_sense().unwrap()).collect();
    assert_eq!(senses, [Direction::Ccw, Direction::Cw, Direction::Ccw, Direction::Cw]);
    for part in &parts {
        let columns = part.columns();
        assert_eq!(columns.load_nm, Condition::Each(columns.time_s.clone()));
        assert_eq!(columns.input_lines, Some(9));
        assert!(Recording::new(columns.clone()).is_ok());
    }
    let mut blind = recording.columns().clone();
    for sample in 158..471 {
        blind.theta2_rad = with(&blind.theta2_rad, sample, f64::NAN);
    }
    blind.theta2_rad = with(&blind.theta2_rad, 157, f64::NAN);
    let senses: Vec<_> = Recording::new(blind).unwrap().segments().iter().map(|part| part.direction).collect();
    assert_eq!(senses, [Direction::Ccw, Direction::Ccw, Direction::Cw], "a part without theta2 holds nothing");
    let owned = parts[1].clone().into_owned();
    assert_eq!(owned, parts[1]);
}

#[test]
fn speed_comes_from_the_motion_where_it_is_not_stated() {
    let mut columns = ramp();
    assert_eq!(Recording::new(columns.clone()).unwrap().driver_rpm(), 5.0);
    columns.speed_rpm = 0.0.into();
    let rpm = Recording::new(columns.clone()).unwrap().driver_rpm();
    // 1 rad/s = 60/2π rpm
    assert!((rpm - 60.0 / TAU).abs() < 1e-9, "{rpm}");
    columns.direction = None;
    columns.theta1_rad = vec![1.0; 1000].into();
    let still = Recording::new(columns).unwrap();
    assert_eq!(still.driver_rpm(), 0.0);
    assert!(matches!(still.one_sense(), Err(RecordingError::Still { .. })));
    assert!(still.split().is_empty());
}

#[test]
fn averages_keep_what_turns_with_their_shaft() {
    // 3 : 1: 12 turns of the driver are 4 of the driven shaft; order 1 of each shaft, and noise-free.
    let pair = GearPair::constant(3.0).unwrap();
    let theta1_rad: Vec<f64> = (0..120_000).map(|i| f64::from(i) * 12.0 * TAU / 120_000.0).collect();
    let (with_driver, with_driven) = (3e-5, 7e-5);
    let mut columns = ramp();
    columns.theta2_rad = theta1_rad
        .iter()
        .map(|theta1| {
            let theta2 = theta1 / 3.0;
            theta2 + with_driver * theta1.cos() + with_driven * theta2.sin()
        })
        .collect();
    columns.time_s = (0..120_000).map(|i| f64::from(i) * 1e-3).collect();
    columns.theta1_rad = theta1_rad.into();
    let recording = Recording::new(columns).unwrap();
    let grid = AngleGrid::default();
    let worst = |run: &RunTe, expected: fn(f64) -> f64| {
        let curve = run.mean_curve();
        grid.centres().zip(&curve.values_rad).map(|(angle, value)| (value - expected(angle)).abs()).fold(0.0, f64::max)
    };
    let driver = recording.te(&pair, grid).unwrap();
    assert_eq!(driver.revolutions(), 12);
    // Order 1 of the driven shaft is a third of a period a turn of the driver: it averages out over three turns.
    // What is left stands in the first and last bin: a revolution that does not close has no slope across its ends.
    let off = worst(&driver, |theta1| 3e-5 * theta1.cos());
    assert!(off < 3e-7, "{off}");
    let driven = recording.te_over_driven(&pair, grid).unwrap();
    assert_eq!(driven.revolutions(), 4);
    // Order 3 of the driven shaft is order 1 of the driver: a whole order of both.
    let off = worst(&driven, |theta2| 3e-5 * (3.0 * theta2).cos() + 7e-5 * theta2.sin());
    assert!(off < 2e-8, "{off}");
}
