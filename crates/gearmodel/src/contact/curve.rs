//! TE over many angles: the contact is solved at Chebyshev nodes and carried between them.
//!
//! ψ2 of a tooth pair that alone touches is an analytic function of θ1 and of the pair's lead ε, the same for all pairs
//! (the tooth's number cancels, see the parent module). So it is solved at a dozen nodes a panel of θ1 and at two or three
//! leads; between leads it is Hermite's polynomial of ψ2 and ∂ψ2/∂ε, between nodes Chebyshev's. As ∂ψ2/∂ε has one sign, the
//! pair that carries is the one in the zone with the largest lead in the sense of motion; the angles at which pairs come and
//! go follow from the contact's arc lengths, carried the same way. What remains an angle is one polynomial.
//!
//! Every panel is checked: against the fall of its series, and against a contact solved between its nodes and leads. One that
//! does not hold is halved, and in the end solved angle by angle. So are panels with few angles, and flanks whose lead changes
//! along the profile.

use std::f64::consts::TAU;

use super::series::{COARSE, NODES, Polynomial, TRAIL, evaluate, filled, fit, foretold, inverse, nodes};
use super::solve::{self, Touch};
use super::{ContactError, ContactModel};
use crate::Direction;

/// Panels a turn of the driver before any halving.
const PANELS: usize = 8;
/// Halvings of a panel before it is solved angle by angle.
const MAX_HALVINGS: u32 = 4;
/// Angles in a panel for which its nodes are worth solving.
const WORTH_A_PANEL: u32 = 3 * NODES as u32;
/// Turns until the same teeth meet again, at most, for which panels are kept.
const MAX_PERIOD_TURNS: u32 = 2000;
/// Last coefficients of TE that end the halving, rad.
const SETTLED_RAD: f64 = 5e-12;
/// The same of the contact's arc lengths, mm: they place a hand-over, within 1e-9 of a turn.
const SETTLED_MM: f64 = 1e-7;
/// Largest difference between a panel and the contact solved within it, rad.
const CHECK_RAD: f64 = 1e-11;

/// A segment of θ1 on which one lead carries.
struct Piece {
    start_rad: f64,
    end_rad: f64,
    middle_rad: f64,
    half_width_rad: f64,
    /// TE over t ∈ [−1, 1]; `None` where the contact is to be solved angle by angle.
    te: Option<Polynomial>,
}

/// ψ2 − f for any lead, and where the contact stands on both flanks, on one panel.
struct Panel {
    middle_rad: f64,
    half_width_rad: f64,
    /// TE and ∂TE/∂ε at each of the leads of the curve.
    te: Vec<(Polynomial, Polynomial)>,
    /// [`Touch::begins_mm`] and [`Touch::ends_mm`], increasing.
    begins_mm: Polynomial,
    ends_mm: Polynomial,
}

/// TE of one sense over the panels that hold enough angles.
struct Curve<'a> {
    model: &'a ContactModel,
    direction: Direction,
    period_rad: f64,
    /// Leads at which the contact is solved, mm: 0 first, and the largest either way.
    leads_mm: Vec<f64>,
    pieces: Vec<Piece>,
    /// Rolling positions less θ1 of the contacts solved last, on panels that adjoin and are of one width, and where they end.
    trail: Vec<(f64, f64)>,
    trail_end: (f64, f64),
}

impl ContactModel {
    /// TE at many angles, rad, as [`ContactModel::te_rad`] gives it at each, to 1e-11 rad (a hand-over within 1e-9 of a turn),
    /// but by some tens of nanoseconds an angle where they are dense. An angle that is not finite is a gap: NaN.
    ///
    /// # Errors
    /// [`ContactError`] when no teeth touch at one of the angles.
    pub fn te_curve_rad(&self, theta1_rad: &[f64], direction: Direction) -> Result<Vec<f64>, ContactError> {
        match Curve::of(self, theta1_rad, direction) {
            Some(curve) => curve.te_rad(theta1_rad),
            None => theta1_rad.iter().map(|theta| self.te_or_gap_rad(*theta, direction)).collect(),
        }
    }

    fn te_or_gap_rad(&self, theta1_rad: f64, direction: Direction) -> Result<f64, ContactError> {
        if theta1_rad.is_finite() { self.te_rad(theta1_rad, direction) } else { Ok(f64::NAN) }
    }
}

impl<'a> Curve<'a> {
    /// The curve of a sense where these angles lie dense; `None` where it is not worth making.
    fn of(model: &'a ContactModel, theta1_rad: &[f64], direction: Direction) -> Option<Self> {
        if !model.pair.has_teeth() || model.teeth.any_shape(direction) || theta1_rad.len() < WORTH_A_PANEL as usize {
            return None;
        }
        // The same teeth meet again after z2/gcd(z1, z2) turns of the driver.
        let (z1, z2) = model.pair.teeth();
        let turns = z2 / greatest_common_divisor(z1, z2);
        if turns > MAX_PERIOD_TURNS {
            return None;
        }
        let (low_mm, high_mm) = model.teeth.pitch_lead_range_mm(direction);
        let leads_mm = [0.0].into_iter().chain([low_mm, high_mm].into_iter().filter(|lead| *lead != 0.0));
        let mut curve = Self {
            model,
            direction,
            period_rad: TAU * f64::from(turns),
            leads_mm: leads_mm.collect(),
            pieces: Vec::new(),
            trail: Vec::new(),
            trail_end: (f64::NAN, f64::NAN),
        };
        curve.leads_mm.dedup();
        let width_rad = TAU / PANELS as f64;
        let mut angles = vec![0_u32; turns as usize * PANELS];
        let last = angles.len() - 1;
        let mut rest = theta1_rad;
        while let Some(first) = rest.first() {
            let within = curve.within_period(*first);
            // An angle that is not finite counts in the first panel, and is a gap later.
            let panel = ((within / width_rad) as usize).min(last);
            let start_rad = first - within + width_rad * panel as f64;
            let count = run(rest, start_rad, start_rad + width_rad);
            angles[panel] += count as u32;
            rest = &rest[count..];
        }
        for (panel, angles) in angles.into_iter().enumerate() {
            let start_rad = width_rad * panel as f64;
            if angles >= WORTH_A_PANEL {
                curve.add(start_rad, start_rad + width_rad, 0);
            }
        }
        (!curve.pieces.is_empty()).then_some(curve)
    }

    fn within_period(&self, theta1_rad: f64) -> f64 {
        // As floor, which is a call on machines without SSE 4.1: the period's count fits an integer, or the angle is lost.
        let turns = theta1_rad / self.period_rad;
        let whole = turns as i64 as f64;
        theta1_rad - self.period_rad * if whole > turns { whole - 1.0 } else { whole }
    }

    /// TE at the angles, rad.
    fn te_rad(&self, theta1_rad: &[f64]) -> Result<Vec<f64>, ContactError> {
        let mut te_rad = vec![0.0; theta1_rad.len()];
        let mut done = 0;
        while let Some(first) = theta1_rad.get(done) {
            let within = self.within_period(*first);
            let shift_rad = first - within;
            let next = self.pieces.partition_point(|piece| piece.start_rad <= within);
            let piece = next.checked_sub(1).map(|index| &self.pieces[index]);
            let rest = &theta1_rad[done..];
            match piece.and_then(|piece| Some((piece, piece.te.as_ref()?))) {
                Some((piece, polynomial)) if within < piece.end_rad => {
                    // Angles come in order as a rule: all that follow in the same piece are one loop without a branch.
                    let (start_rad, end_rad) = (piece.start_rad + shift_rad, piece.end_rad + shift_rad);
                    let count = run(rest, start_rad, end_rad);
                    let (middle_rad, scale) = (piece.middle_rad + shift_rad, 1.0 / piece.half_width_rad);
                    for (te, theta) in te_rad[done..done + count].iter_mut().zip(rest) {
                        *te = evaluate(polynomial, (theta - middle_rad) * scale);
                    }
                    done += count;
                }
                _ => {
                    te_rad[done] = self.model.te_or_gap_rad(*first, self.direction)?;
                    done += 1;
                }
            }
        }
        Ok(te_rad)
    }

    /// Adds the pieces of a segment of θ1.
    fn add(&mut self, start_rad: f64, end_rad: f64, halvings: u32) {
        let half_width_rad = 0.5 * (end_rad - start_rad);
        let middle_rad = start_rad + half_width_rad;
        match self.panel(middle_rad, half_width_rad) {
            Ok(Some(panel)) => self.split(&panel),
            Ok(None) if halvings < MAX_HALVINGS => {
                self.add(start_rad, middle_rad, halvings + 1);
                self.add(middle_rad, end_rad, halvings + 1);
            }
            // No polynomial holds here, or a node has no contact: every angle is asked by itself.
            Ok(None) | Err(_) => self.pieces.push(Piece { start_rad, end_rad, middle_rad, half_width_rad, te: None }),
        }
    }

    /// Solves and fits one panel; `None` where it has not settled.
    fn panel(&mut self, middle_rad: f64, half_width_rad: f64) -> Result<Option<Panel>, ContactError> {
        let (mut te, mut slope) = ([0.0; NODES], [0.0; NODES]);
        // What a lead changes beyond TE + ε ∂TE/∂ε, and beyond ∂TE/∂ε: small, so that every second node will do.
        let mut beyond = vec![([0.0; COARSE], [0.0; COARSE]); self.leads_mm.len() - 1];
        let (mut begins_mm, mut ends_mm) = ([0.0; NODES], [0.0; NODES]);
        let (start_rad, end_rad) = (middle_rad - half_width_rad, middle_rad + half_width_rad);
        let adjoins = (start_rad - self.trail_end.0).abs() + (half_width_rad - self.trail_end.1).abs() < 1e-9;
        if !adjoins {
            self.trail.clear();
        }
        self.trail_end = (end_rad, half_width_rad);
        for (node, t) in nodes().iter().enumerate() {
            let theta1_rad = middle_rad + half_width_rad * t;
            let theta2_rad = self.model.pair.theta2(theta1_rad);
            let shared = self.touch(theta1_rad, 0.0, self.foretold_rad(node, theta1_rad))?;
            let (theta_a, theta_b) = shared.theta_rad();
            self.trail.push((theta_a - theta1_rad, theta_b - theta1_rad));
            (begins_mm[node], ends_mm[node]) = (shared.begins_mm(), shared.ends_mm());
            (te[node], slope[node]) = (shared.psi2_rad - theta2_rad, shared.psi2_per_lead);
            if node % 2 == 0 {
                for (lead_mm, (value, rate)) in self.leads_mm[1..].iter().zip(&mut beyond) {
                    let touch = self.touch(theta1_rad, *lead_mm, Some(shared.theta_with_lead_rad(*lead_mm)))?;
                    value[node / 2] = touch.psi2_rad - shared.psi2_rad - lead_mm * shared.psi2_per_lead;
                    rate[node / 2] = touch.psi2_per_lead - shared.psi2_per_lead;
                }
            }
        }
        let ((begins_mm, begins_tail_mm), (ends_mm, ends_tail_mm)) = (fit(&begins_mm), fit(&ends_mm));
        let mut settled = begins_tail_mm.max(ends_tail_mm) < SETTLED_MM;
        let span_mm = self.leads_mm.iter().fold(0.0_f64, |span, lead| span.max(lead.abs()));
        let perfect = (fit(&te), fit(&slope));
        // Hermite's polynomials give a slope at most 4/27 of the span.
        settled &= perfect.0.1.max(0.15 * span_mm * perfect.1.1) < SETTLED_RAD;
        let mut fitted = vec![(perfect.0.0, perfect.1.0)];
        for (lead_mm, (value, rate)) in self.leads_mm[1..].iter().zip(&beyond) {
            let (mut value, mut rate) = (filled(value), filled(rate));
            for node in 0..NODES {
                value[node] += te[node] + lead_mm * slope[node];
                rate[node] += slope[node];
            }
            fitted.push((fit(&value).0, fit(&rate).0));
        }
        if !settled {
            return Ok(None);
        }
        let panel = Panel { middle_rad, half_width_rad, te: fitted, begins_mm, ends_mm };
        // Between two leads, and between the last node at which they are all solved and the end: interpolation at its worst.
        let t = 0.5 * (nodes()[NODES - 2] + 1.0);
        let theta1_rad = middle_rad + half_width_rad * t;
        let theta2_rad = self.model.pair.theta2(theta1_rad);
        let start = self.trail.last().map(|(a, b)| (theta1_rad + a, theta1_rad + b));
        for lead_mm in if self.leads_mm.len() > 1 { &self.leads_mm[1..] } else { &self.leads_mm[..] } {
            let lead_mm = 0.75 * lead_mm;
            let solved_rad = self.touch(theta1_rad, lead_mm, start)?.psi2_rad - theta2_rad;
            let carried_rad = evaluate(&self.with_lead(&panel, lead_mm), t);
            if (solved_rad - carried_rad).abs() > CHECK_RAD {
                return Ok(None);
            }
        }
        Ok(Some(panel))
    }

    /// Where the rolling positions of the contacts before lead; `None` at the first nodes.
    fn foretold_rad(&self, node: usize, theta1_rad: f64) -> Option<(f64, f64)> {
        let known = &self.trail[self.trail.len().checked_sub(TRAIL)?..];
        Some(
            known
                .iter()
                .zip(foretold(node))
                .fold((theta1_rad, theta1_rad), |start, ((a, b), weight)| (start.0 + weight * a, start.1 + weight * b)),
        )
    }

    fn touch(&self, theta1_rad: f64, lead_mm: f64, start_rad: Option<(f64, f64)>) -> Result<Touch, ContactError> {
        solve::touch(&self.model.pair, &self.model.displacement, theta1_rad, self.direction, lead_mm, start_rad)
    }

    /// TE of a pair with a lead: Hermite's polynomial through the values and slopes at the leads,
    /// Σ_e [(1 − 2 l_e'(ε_e)(ε − ε_e)) TE_e + (ε − ε_e) TE_e'] l_e(ε)², l_e Lagrange's polynomials.
    fn with_lead(&self, panel: &Panel, lead_mm: f64) -> Polynomial {
        let mut te = [0.0; NODES];
        for (index, (at_mm, (value, slope))) in self.leads_mm.iter().zip(&panel.te).enumerate() {
            let others = || self.leads_mm.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, mm)| mm);
            let lagrange: f64 = others().map(|other| (lead_mm - other) / (at_mm - other)).product();
            let lagrange_slope: f64 = others().map(|other| 1.0 / (at_mm - other)).sum();
            let square = lagrange * lagrange;
            let of_value = (1.0 - 2.0 * lagrange_slope * (lead_mm - at_mm)) * square;
            let of_slope = (lead_mm - at_mm) * square;
            for (sum, (value, slope)) in te.iter_mut().zip(value.iter().zip(slope)) {
                *sum += of_value * value + of_slope * slope;
            }
        }
        te
    }

    /// Splits a panel where the lead that carries changes.
    fn split(&mut self, panel: &Panel) {
        let ends = |of: &Polynomial| (evaluate(of, -1.0), evaluate(of, 1.0));
        let ((begin_low, begin_high), (end_low, end_high)) = (ends(&panel.begins_mm), ends(&panel.ends_mm));
        let tips = &self.model.tips;
        // (from, to, lead) in t of every tooth pair that passes
        let mut passages: Vec<(f64, f64, f64)> = Vec::new();
        for tooth in tips.candidates_between((begin_low.min(end_low), begin_high.max(end_high)), self.direction) {
            let (begin_mm, end_mm) = tips.passage_mm(tooth, self.direction);
            if begin_mm < begin_high && end_mm > end_low {
                let from = if begin_mm <= begin_low {
                    -1.0
                } else {
                    inverse(&panel.begins_mm, (begin_low, begin_high), begin_mm)
                };
                let to = if end_mm >= end_high { 1.0 } else { inverse(&panel.ends_mm, (end_low, end_high), end_mm) };
                passages.push((from, to, self.model.teeth.pitch_lead_mm(tooth, self.direction)));
            }
        }
        let mut edges: Vec<f64> = passages.iter().flat_map(|(from, to, _)| [*from, *to]).chain([-1.0, 1.0]).collect();
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let mut last: Option<Option<f64>> = None;
        for edge in edges.windows(2) {
            let middle = 0.5 * (edge[0] + edge[1]);
            let leads = passages.iter().filter(|(from, to, _)| (*from..*to).contains(&middle)).map(|passage| passage.2);
            // Most advanced in the sense of motion: a lead moves the driven gear ahead (+θ2) in both senses.
            let sign = self.direction.sign();
            let carrying_mm = leads.max_by(|a, b| (sign * a).total_cmp(&(sign * b)));
            let at_rad = |t: f64| panel.middle_rad + panel.half_width_rad * t;
            match self.pieces.last_mut() {
                Some(piece) if last == Some(carrying_mm) => piece.end_rad = at_rad(edge[1]),
                _ => self.pieces.push(Piece {
                    start_rad: at_rad(edge[0]),
                    end_rad: at_rad(edge[1]),
                    middle_rad: panel.middle_rad,
                    half_width_rad: panel.half_width_rad,
                    // Without a pair in the zone the single angle's answer is the error to give.
                    te: carrying_mm.map(|lead_mm| self.with_lead(panel, lead_mm)),
                }),
            }
            last = Some(carrying_mm);
        }
    }
}

/// How many angles, the first whatever it is, lie in one segment before one that does not.
fn run(theta1_rad: &[f64], start_rad: f64, end_rad: f64) -> usize {
    theta1_rad.iter().skip(1).take_while(|theta| start_rad <= **theta && **theta < end_rad).count() + 1
}

fn greatest_common_divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ToothErrors;
    use crate::{CircularSpec, EllipticalSpec, Errors, GearPair};

    #[test]
    fn panels_of_usual_pairs_hold() {
        let mut pairs = vec![GearPair::circular(&CircularSpec::default()).unwrap()];
        for k in [0.1, 0.3287, 0.6] {
            pairs.push(GearPair::elliptical(&EllipticalSpec { eccentricity: k, ..Default::default() }).unwrap());
        }
        let errors = Errors { e1_mm: 0.1, e2_mm: 0.08, phi1_rad: 0.3, phi2_rad: 1.1, ..Default::default() };
        let angles: Vec<f64> = (0..720).map(|n| TAU * f64::from(n) / 720.0).collect();
        for pair in pairs {
            let lead = |n: i32| 0.05 * f64::from(n * n % 13 - 6) / 6.0;
            let table: Vec<f64> = (0..47).map(lead).collect();
            let teeth = ToothErrors { driver_pitch_mm: [table.clone(), table], ..Default::default() };
            let model = ContactModel::new(pair, &errors).unwrap().with_tooth_errors(teeth).unwrap();
            for direction in Direction::BOTH {
                let curve = Curve::of(&model, &angles, direction).unwrap();
                assert!(curve.pieces.len() > 47 && curve.pieces.iter().all(|piece| piece.te.is_some()));
                let apart = |pieces: &[Piece]| (pieces[0].end_rad - pieces[1].start_rad).abs();
                assert!(curve.pieces.windows(2).all(|pieces| apart(pieces) < 1e-14));
            }
        }
    }
}
