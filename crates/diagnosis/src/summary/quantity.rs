//! Numbers for people: as many digits as are known, units that keep them between 0.1 and 1000, phases in degrees.

use serde_json::Value as Json;

/// What a parameter's name ends with, by unit, and how it is shown: factor and unit.
const SHOWN: [(&str, f64, &str); 7] = [
    ("rad", 1e6, "urad"),
    ("mm", 1e3, "um"),
    ("s", 1e6, "us"),
    ("rad/(N.m)", 1e6, "urad/(N.m)"),
    ("rad/(rev.N.m)", 1e6, "urad/(rev.N.m)"),
    ("mm/N", 1e3, "um/N"),
    ("mm/(rev.N.m)", 1e3, "um/(rev.N.m)"),
];

/// Endings that only repeat the unit.
const ENDINGS: [&str; 10] = [
    "_rad_per_rev_nm",
    "_mm2_rad_per_nm",
    "_mm_per_rev_nm",
    "_rad_per_nm",
    "_mm_per_n",
    "_rad",
    "_mm",
    "_hz",
    "_nm",
    "_s",
];

/// A parameter entry `{"value", "std", "unit"}` as text, its name first.
#[must_use]
pub fn parameter(name: &str, entry: &Json) -> String {
    let unit = entry["unit"].as_str().unwrap_or_default();
    let short = ENDINGS.iter().find_map(|end| name.strip_suffix(end)).unwrap_or(name);
    if let Some(values) = entry["value"].as_array() {
        let values: Vec<f64> = values.iter().filter_map(Json::as_f64).collect();
        let peak = values.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let most = values.iter().position(|x| x.abs() >= peak).unwrap_or(0);
        let (factor, unit) = scaled(peak, unit);
        return format!(
            "{short}: {} values up to {} (tooth {most})",
            values.len(),
            with_unit(&plain(factor * peak), unit)
        );
    }
    let Some(value) = entry["value"].as_f64() else {
        return format!("{short} {}", entry["value"].as_str().unwrap_or("unknown"));
    };
    let std = entry["std"].as_f64().filter(|s| *s > 0.0 && s.is_finite());
    let angle = unit == "rad" && (short.starts_with("ph") || short == "beta");
    if angle {
        let text = measured(value.to_degrees(), std.map(f64::to_degrees));
        return format!("{short} {text} deg");
    }
    let (factor, unit) = scaled(value.abs().max(std.unwrap_or(0.0)), unit);
    let text = measured(factor * value, std.map(|s| factor * s));
    format!("{short} = {}", with_unit(&text, unit))
}

fn with_unit(text: &str, unit: &str) -> String {
    if unit.is_empty() { text.to_owned() } else { format!("{text} {unit}") }
}

/// Factor and unit that suit a size.
fn scaled(size: f64, unit: &str) -> (f64, &str) {
    match SHOWN.iter().find(|(from, _, _)| *from == unit) {
        // A time constant in s or a gap in mm stays as it is.
        Some((_, factor, to)) if size < 0.5 => (*factor, to),
        _ => (1.0, unit),
    }
}

/// A value with its standard deviation, both to the deviation's first digit, or its second where the first is 1 or 2.
#[must_use]
pub fn measured(value: f64, std: Option<f64>) -> String {
    let Some(std) = std.filter(|s| *s > 0.0 && s.is_finite() && value.is_finite()) else { return plain(value) };
    let size = value.abs().max(std);
    let exponent = size.log10().floor() as i32;
    let mut last = std.log10().floor() as i32;
    if std / 10.0_f64.powi(last) < 2.95 {
        last -= 1;
    }
    // The value keeps at most six digits, however small the deviation.
    last = last.max(exponent - 5);
    if (-3..5).contains(&exponent) {
        let digits = (-last).max(0) as usize;
        format!("{value:.digits$} +- {std:.digits$}")
    } else {
        let unit = 10.0_f64.powi(exponent);
        let digits = (exponent - last).max(0) as usize;
        format!("({:.digits$} +- {:.digits$})e{exponent}", value / unit, std / unit)
    }
}

/// A number without a deviation, to four digits.
#[must_use]
pub fn plain(value: f64) -> String {
    if value == 0.0 || !value.is_finite() || value.fract() == 0.0 && value.abs() < 1e6 {
        return format!("{value}");
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-3..5).contains(&exponent) {
        let digits = (3 - exponent).clamp(0, 6) as usize;
        let text = format!("{value:.digits$}");
        if digits > 0 { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.3e}")
    }
}

/// Micro-radians of an angle in rad, to three digits but not beyond a hundredth.
#[must_use]
pub fn urad(angle_rad: f64) -> String {
    let value = 1e6 * angle_rad;
    match value.abs() {
        x if !x.is_finite() => "unknown".to_owned(),
        x if x >= 99.95 => format!("{value:.0}"),
        x if x >= 0.995 || x == 0.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

/// A probability; never rounded to a certainty.
#[must_use]
pub fn probability(p: f64) -> String {
    match p {
        p if p >= 0.9995 => "> 0.999".to_owned(),
        p if p < 0.0005 => "< 0.001".to_owned(),
        p => format!("= {p:.3}"),
    }
}

/// A share as a percentage.
#[must_use]
pub fn percent(share: f64) -> String {
    format!("{} %", tenth(100.0 * share))
}

/// A number to a tenth; none is a negative zero.
#[must_use]
pub fn tenth(value: f64) -> String {
    let text = format!("{value:.1}");
    if text == "-0.0" { "0.0".to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn digits_follow_the_deviation() {
        assert_eq!(measured(71.23, Some(0.41)), "71.2 +- 0.4");
        assert_eq!(measured(71.23, Some(0.14)), "71.23 +- 0.14");
        assert_eq!(measured(3.98e-5, Some(3.1e-7)), "(3.98 +- 0.03)e-5");
        assert_eq!(measured(1234.0, Some(56.0)), "1234 +- 56");
        assert_eq!(measured(0.0, Some(0.02)), "0.000 +- 0.020");
        assert_eq!(measured(2.5, None), "2.5");
    }

    #[test]
    fn a_deviation_that_is_no_number_is_not_shown() {
        assert_eq!(measured(2.5, Some(f64::NAN)), "2.5");
        assert_eq!(measured(2.5, Some(0.0)), "2.5");
    }

    #[test]
    fn parameters_drop_the_unit_from_the_name_and_turn_phases_to_degrees() {
        let entry = |value: f64, std: f64, unit: &str| json!({"value": value, "std": std, "unit": unit});
        assert_eq!(parameter("phase_rad", &entry(1.0, 0.01, "rad")), "phase 57.3 +- 0.6 deg");
        assert_eq!(parameter("eps", &entry(3.98e-5, 3e-7, "")), "eps = (3.98 +- 0.03)e-5");
        assert_eq!(parameter("dx_mm", &entry(0.0123, 0.0004, "mm")), "dx = 12.3 +- 0.4 um");
        assert_eq!(parameter("tau_s", &entry(300.0, 20.0, "s")), "tau = 300 +- 20 s");
        let table = json!({"value": [0.001, -0.012, 0.0], "std": null, "unit": "mm"});
        assert_eq!(parameter("ccw_mm", &table), "ccw: 3 values up to 12 um (tooth 1)");
    }

    #[test]
    fn no_probability_reads_as_certainty() {
        assert_eq!(probability(1.0), "> 0.999");
        assert_eq!(probability(0.0), "< 0.001");
        assert_eq!(probability(0.9981), "= 0.998");
        assert_eq!(percent(-0.0001), "0.0 %");
    }
}
