//! Distinct loads and speeds among values that scatter.

/// Distinct values, at most as many as are booked apart; nearer than a part `same` of the largest count as one.
pub(super) fn levels(values: impl Iterator<Item = f64>, same: f64) -> Vec<f64> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    let mut sorted: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let reach = sorted.iter().fold(0.0_f64, |m, v| m.max(v.abs())) * same;
    for value in sorted {
        match found.last_mut() {
            Some((mean, count)) if value - *mean <= reach => {
                *mean += (value - *mean) / (*count + 1.0);
                *count += 1.0;
            }
            _ => found.push((value, 1.0)),
        }
    }
    // More levels than are booked apart: the nearest neighbours become one.
    while found.len() > gearmodel::effect::MOST_LOADS {
        let Some(at) =
            (1..found.len()).min_by(|a, b| (found[*a].0 - found[*a - 1].0).total_cmp(&(found[*b].0 - found[*b - 1].0)))
        else {
            break;
        };
        let (value, count) = found.remove(at);
        let (mean, had) = found[at - 1];
        found[at - 1] = ((mean * had + value * count) / (had + count), had + count);
    }
    found.into_iter().map(|(mean, _)| mean).collect()
}
