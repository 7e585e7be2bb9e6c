//! The built-in maps against the codecs that the emulators use, and what a wrong map is told.

use wire::{asda_b2, rd60xx};

use super::*;

fn map(name: &str) -> Map {
    let (_, text) = BUILT_IN.iter().find(|(known, _)| *known == name).expect("built in");
    Map::parse(text).unwrap_or_else(|faults| panic!("{name}: {faults:?}"))
}

#[test]
fn built_in_maps_are_good_and_state_their_sources() {
    for (name, _) in BUILT_IN {
        let map = map(name);
        assert_eq!(&map.name, name);
        assert!(!map.source.is_empty());
    }
}

#[test]
fn the_drive_of_the_map_is_the_drive_of_the_codec() {
    let map = map("asda-b2");
    for (name, codec) in [
        ("firmware", &asda_b2::FIRMWARE),
        ("alarm", &asda_b2::ALARM),
        ("status_monitor_code", &asda_b2::STATUS_MONITOR_CODE),
        ("torque_code", &asda_b2::MONITOR_1_CODE),
        ("outputs", &asda_b2::OUTPUTS),
        ("speed_1", &asda_b2::SPEED_1),
        ("ramp_up", &asda_b2::RAMP_UP),
        ("ramp_down", &asda_b2::RAMP_DOWN),
        ("input_1", &asda_b2::INPUT_FUNCTIONS[0]),
        ("input_2", &asda_b2::INPUT_FUNCTIONS[1]),
        ("input_3", &asda_b2::INPUT_FUNCTIONS[2]),
        ("auxiliary", &asda_b2::AUXILIARY),
        ("fault_action", &asda_b2::FAULT_ACTION),
        ("watchdog", &asda_b2::WATCHDOG),
        ("input_source", &asda_b2::INPUT_SOURCE),
        ("inputs", &asda_b2::INPUTS),
    ] {
        let ours = map.register(name, None).expect(name);
        assert_eq!(
            (ours.address, ours.kind, ours.scale, &ours.unit, ours.min_raw, ours.max_raw, ours.access),
            (codec.address, codec.kind, codec.scale, &codec.unit, codec.min_raw, codec.max_raw, codec.access),
            "{name}"
        );
    }
}

#[test]
fn the_drive_of_the_map_tells_its_torque_and_its_emergency_stop() {
    let map = map("asda-b2");
    let servo = map.servo.as_ref().expect("a servo");
    let name = servo.status.torque.as_deref().expect("it tells its torque");
    let ours = map.register(name, None).expect("listed");
    assert_eq!((ours.address, ours.kind), (asda_b2::MONITOR_1.address, asda_b2::MONITOR_1.kind));
    assert_eq!((ours.scale, &*ours.unit), (asda_b2::monitor::TORQUE_STEP_PERCENT, "%"));
    let shown = servo.prepare.iter().find(|step| step.set == "torque_code").expect("the monitor shows the torque");
    assert_eq!(shown.value(&[]), f64::from(asda_b2::monitor::TORQUE));
    assert_eq!(servo.emergency_stop_alarm, Some(asda_b2::ALARM_EMERGENCY_STOP));
}

#[test]
fn the_source_of_the_map_has_each_models_scales() {
    let map = map("rd60xx");
    for model in [rd60xx::Model::Rd6006, rd60xx::Model::Rd6006P, rd60xx::Model::Rd6012, rd60xx::Model::Rd6018] {
        let codec = rd60xx::Map::new(model);
        let rules = map.models.iter().find(|rules| rules.name == model.to_string()).expect("listed");
        assert!((rules.ids[0]..=rules.ids[1]).contains(&model.id()));
        for (name, codec) in [
            ("voltage_set", &codec.voltage_set),
            ("current_set", &codec.current_set),
            ("current_out", &codec.current_out),
            ("voltage_out", &codec.voltage_out),
            ("temperature", &codec.temperature),
            ("protection", &codec.protection),
            ("enable", &codec.enable),
        ] {
            let ours = map.register(name, Some(rules)).expect(name);
            assert_eq!((ours.address, ours.kind, ours.max_raw), (codec.address, codec.kind, codec.max_raw), "{name}");
            assert!((ours.scale - codec.scale).abs() < 1e-15, "{model} {name}");
        }
    }
}

#[test]
fn every_fault_is_told_at_once_with_its_line() {
    let (_, good) = BUILT_IN[0];
    let wrong = good
        .replace("silence_ms = 10", "silence_ms = -1")
        .replace("speed_set = \"speed_1\"", "speed_set = \"speed_9\"")
        .replace("address = 0x0144, type = \"u16\"", "address = 0x0144, type = \"u32\"")
        .replace("to = \"lease_s\"", "to = \"lease\"")
        .replace("{ set = \"fault_action\", to = 1 }", "{ set = \"fault_action\", to = 7 }");
    let faults = Map::parse(&wrong).expect_err("five faults");
    let said = faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
    for part in ["line.silence_ms = -1", "'speed_9'", "has two words", "'lease'", "7"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert_eq!(faults.len(), 5, "{said}");
    let line = wrong.lines().position(|line| line.contains("silence_ms = -1")).expect("there") + 1;
    assert!(faults.iter().any(|fault| fault.line == line), "{said}");
}

#[test]
fn a_lease_is_rounded_up_and_other_quantities_are_scaled() {
    let step = |name: &str, times| Step { set: "x".into(), to: StepValue::Quantity(name.into()), times };
    assert_eq!(step("lease_s", 1.0).value(&[("lease_s", 1.2)]), 2.0);
    assert_eq!(step("accel_ms", 0.5).value(&[("accel_ms", 3000.0)]), 1500.0);
}

#[test]
fn tests_look_at_bits_values_and_thresholds() {
    let test = |mask, equals, at_least| Test { register: "x".into(), mask, equals, at_least, advice: String::new() };
    assert!(test(Some(2), None, None).holds(6.0) && !test(Some(2), None, None).holds(5.0));
    assert!(test(Some(0xFF), Some(2), None).holds(f64::from(0x102)) && !test(None, Some(2), None).holds(258.0));
    assert!(test(None, None, Some(2)).holds(2.0) && !test(None, None, Some(2)).holds(1.0));
}
