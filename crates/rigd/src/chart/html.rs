//! A chart as a page of its own: the SVG, and the values under the pointer.

use std::fmt::Write as _;

use plotters::style::Color as _;
use serde_json::json;

use super::{Axis, Chart, ChartError, Mark, Scale, render};

/// Shows the nearest point of each curve; needs nothing from elsewhere.
const SCRIPT: &str = include_str!("hover.js");

/// The page.
pub fn page(chart: &Chart) -> Result<String, ChartError> {
    let (svg, frames) = render::svg(chart)?;
    let panels: Vec<_> = chart
        .panels
        .iter()
        .zip(&frames)
        .filter_map(|(panel, frame)| {
            let frame = frame.as_ref()?;
            let parts = [frame.x_px.start, frame.x_px.end, frame.y_px.start, frame.y_px.end];
            let px = parts.map(|parts| f64::from(parts) / f64::from(render::SVG_SCALE));
            let series: Vec<_> = panel
                .series
                .iter()
                .map(|series| {
                    let (red, green, blue) = series.ink.colour().rgb();
                    json!({
                        "name": series.name,
                        "colour": format!("rgb({red},{green},{blue})"),
                        "line": series.mark == Mark::Line,
                        "points": series.points.iter().filter(|(x, y)| x.is_finite() && panel.scale.height(*y).is_finite()).collect::<Vec<_>>(),
                    })
                })
                .collect();
            Some(json!({
                "x": axis_label(&panel.x),
                "y": panel.y_label,
                "nearest": panel.scale == Scale::Equal,
                "log": panel.scale == Scale::Logarithmic,
                "px": px,
                "at": [frame.x.start, frame.x.end, frame.y.start, frame.y.end],
                "series": series,
            }))
        })
        .collect();
    // Inside a script element only "</" could end it.
    let data = json!(panels).to_string().replace("</", "<\\/");
    let title = chart.panels.first().map_or_else(String::new, |panel| escape(&panel.title));
    let mut page = String::new();
    // Writing to a String cannot fail.
    let _ = write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title}</title>\n<style>\n\
         body {{ margin: 1em; font-family: sans-serif }}\n#chart {{ position: relative; display: inline-block }}\n\
         #values {{ position: absolute; display: none; pointer-events: none; background: #fffe; border: 1px solid #999; \
         padding: 0.3em 0.6em; font-size: 12px; white-space: pre; z-index: 1 }}\n</style>\n</head>\n<body>\n\
         <div id=\"chart\">\n{svg}\n<div id=\"values\"></div>\n</div>\n<script>\nconst panels = {data};\n{SCRIPT}</script>\n\
         </body>\n</html>\n"
    );
    Ok(page)
}

fn axis_label(axis: &Axis) -> &str {
    match axis {
        Axis::Turn => "θ1 / °",
        Axis::Fitted(label) => label,
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
