//! Colors of surfaces: each is written once.

use std::collections::BTreeMap;

use super::step::{Id, Step};
use crate::formats::text::number::Number;
use crate::model::palette::Rgb;

/// The styles that are written so far.
#[derive(Debug, Default)]
pub(crate) struct Styles(BTreeMap<Rgb, Id>);

impl Styles {
    /// Paints an item of a body.
    pub(crate) fn paint(&mut self, step: &mut Step, item: Id, color: Rgb) {
        let style = *self.0.entry(color).or_insert_with(|| {
            let [r, g, b] = color.map(|value| f64::from(value) / 255.0);
            let color = step.add(format_args!("IFCCOLOURRGB($,{},{},{})", Number(r), Number(g), Number(b)));
            let shading = step.add(format_args!("IFCSURFACESTYLESHADING({color},$)"));
            step.add(format_args!("IFCSURFACESTYLE($,.BOTH.,({shading}))"))
        });
        step.add(format_args!("IFCSTYLEDITEM({item},({style}),$)"));
    }
}
