//! Parameters of the model on the command line: `KEY=VALUES`, by the names of `pair.toml`.

use gearmodel::sensitivity::Parameter;

use crate::quantity::tidy;

/// Most values that a range may expand to.
const MAX_VALUES: usize = 1_000_000;

/// The parameter of a name, or those that there are.
///
/// # Errors
/// A text for the command line's own message.
pub fn parameter(name: &str) -> Result<Parameter, String> {
    Parameter::from_name(name).ok_or_else(|| {
        let known: Vec<_> = Parameter::ALL.iter().map(|parameter| parameter.name()).collect();
        format!("'{name}' is no parameter of the model; there are {}", known.join(", "))
    })
}

/// `KEY=0.2,0.4` or `KEY=0..0.1:0.02`.
///
/// # Errors
/// A text that shows the right form.
pub fn axis(text: &str) -> Result<(Parameter, Vec<f64>), String> {
    let form = "write KEY=A,B,C or KEY=FIRST..LAST:STEP, for instance eccentricity=0.2,0.4 or e1_mm=0..0.1:0.02";
    let wrong = || format!("'{text}' is no axis; {form}");
    let (name, values) = text.split_once('=').ok_or_else(wrong)?;
    let parameter = parameter(name.trim())?;
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(wrong);
    let values = match values.split_once("..") {
        None => values.split(',').map(number).collect::<Result<Vec<_>, _>>()?,
        Some((first, rest)) => {
            let (last, step) = rest.split_once(':').ok_or_else(wrong)?;
            let (first, last, step) = (number(first)?, number(last)?, number(step)?);
            // A step that ends a rounding error short of the last value still reaches it.
            let steps = ((last - first) / step * (1.0 + 1e-12) + 1e-9).floor();
            if step <= 0.0 || last < first || steps >= MAX_VALUES as f64 {
                return Err(format!("'{text}' needs FIRST <= LAST, STEP > 0 and at most {MAX_VALUES} values; {form}"));
            }
            (0..=steps as usize).map(|n| tidy(first + n as f64 * step)).collect()
        }
    };
    Ok((parameter, values))
}

/// `KEY=WIDTH`.
///
/// # Errors
/// A text that shows the right form.
pub fn width(text: &str) -> Result<(Parameter, f64), String> {
    let wrong = || format!("'{text}' is no scatter; write KEY=WIDTH with WIDTH >= 0, for instance e1_mm=0.01");
    let (name, value) = text.split_once('=').ok_or_else(wrong)?;
    let width =
        value.trim().parse::<f64>().ok().filter(|width| width.is_finite() && *width >= 0.0).ok_or_else(wrong)?;
    Ok((parameter(name.trim())?, width))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_lists_or_ranges() {
        let (parameter, values) = axis("e1_mm=0..0.1:0.02").unwrap();
        assert_eq!((parameter, values.len()), (Parameter::E1Mm, 6));
        assert_eq!(values, [0.0, 0.02, 0.04, 0.06, 0.08, 0.1]);
        assert_eq!(axis("eccentricity=0.2, 0.4").unwrap().1, [0.2, 0.4]);
        for wrong in ["e1_mm", "e1_mm=", "e1_mm=0..1", "e1_mm=1..0:0.1", "e1_mm=0..1:0", "e1_mm=nan", "e1_mm=0..1e9:1"]
        {
            assert!(axis(wrong).is_err(), "{wrong}");
        }
        assert!(axis("colour=1").unwrap_err().contains("eccentricity"));
        assert!(width("e1_mm=-1").is_err());
    }
}
