//! Colours that most kinds of colour vision tell apart, and whose greys differ.
//!
//! Okabe and Ito (2008), *Color Universal Design*: eight colours distinguished with normal vision, protanopia and deuteranopia.

/// A colour of Okabe and Ito's set, plus a grey for what stands in the background.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    Black,
    /// Mid grey, not of the set.
    Grey,
    Orange,
    SkyBlue,
    Green,

    Blue,
    Vermillion,
    Purple,
    /// For marks on dark maps.
    White,
}

impl Colour {
    /// In the order in which curves take them; neighbours differ in grey value too.
    pub const CYCLE: [Self; 7] =
        [Self::Black, Self::Vermillion, Self::Blue, Self::Orange, Self::Green, Self::Purple, Self::SkyBlue];

    /// Red, green, blue, 0…255.
    #[must_use]
    pub(crate) const fn rgb(self) -> (u8, u8, u8) {
        match self {
            Self::Black => (0, 0, 0),
            Self::Grey => (120, 120, 120),
            Self::Orange => (230, 159, 0),
            Self::SkyBlue => (86, 180, 233),
            Self::Green => (0, 158, 115),

            Self::Blue => (0, 114, 178),
            Self::Vermillion => (213, 94, 0),
            Self::Purple => (204, 121, 167),
            Self::White => (255, 255, 255),
        }
    }

    /// A light tint of the colour for filled areas: `share` of the colour on white.
    #[must_use]
    pub(crate) fn tint(self, share: f64) -> (u8, u8, u8) {
        let (red, green, blue) = self.rgb();
        let mix = |channel: u8| (255.0 + share * (f64::from(channel) - 255.0)).round() as u8;
        (mix(red), mix(green), mix(blue))
    }
}

/// Shade of a map at `share` (0 light … 1 dark): one hue, lightness falling evenly, so that greyscale keeps the order.
pub(super) fn shade(share: f64) -> (u8, u8, u8) {
    const STOPS: [(f64, f64, f64); 6] = [
        (250.0, 252.0, 255.0),
        (214.0, 229.0, 243.0),
        (160.0, 200.0, 228.0),
        (92.0, 157.0, 204.0),
        (34.0, 105.0, 166.0),
        (8.0, 48.0, 107.0),
    ];
    between(&STOPS, share)
}

/// Colour of a signed map at `share` (0 most negative, ½ zero, 1 most positive): blue, white, red, distinguished with every common kind of colour
/// vision, lightness falling evenly to both ends.
///
/// *RdBu* turned round, Harrower and Brewer (2003), *The Cartographic Journal* 40, 27 (colorbrewer2.org, Apache 2.0).
pub(super) fn signed(share: f64) -> (u8, u8, u8) {
    const STOPS: [(f64, f64, f64); 11] = [
        (5.0, 48.0, 97.0),
        (33.0, 102.0, 172.0),
        (67.0, 147.0, 195.0),
        (146.0, 197.0, 222.0),
        (209.0, 229.0, 240.0),
        (255.0, 255.0, 255.0),
        (253.0, 219.0, 199.0),
        (244.0, 165.0, 130.0),
        (214.0, 96.0, 77.0),
        (178.0, 24.0, 43.0),
        (103.0, 0.0, 31.0),
    ];
    between(&STOPS, share)
}

/// Viridis at `share` (0 dark violet … 1 yellow), the default of Matplotlib (CC0): even steps look even.
pub(super) fn viridis(share: f64) -> (u8, u8, u8) {
    const STOPS: [(f64, f64, f64); 6] = [
        (68.0, 1.0, 84.0),
        (65.0, 68.0, 135.0),
        (42.0, 120.0, 142.0),
        (34.0, 168.0, 132.0),
        (122.0, 209.0, 81.0),
        (253.0, 231.0, 37.0),
    ];
    between(&STOPS, share)
}

/// The colour at `share` of the way along evenly spaced stops.
fn between(stops: &[(f64, f64, f64)], share: f64) -> (u8, u8, u8) {
    let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let index = (place.floor() as usize).min(stops.len() - 2);
    let rest = place - index as f64;
    let (from, to) = (stops[index], stops[index + 1]);
    let mix = |a: f64, b: f64| (a + rest * (b - a)).round() as u8;
    (mix(from.0, to.0), mix(from.1, to.1), mix(from.2, to.2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance, 0 black … 1 white (sRGB, IEC 61966-2-1).
    fn luminance((red, green, blue): (u8, u8, u8)) -> f64 {
        let linear = |channel: u8| {
            let share = f64::from(channel) / 255.0;
            if share <= 0.040_45 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue)
    }

    #[test]
    fn a_signed_map_is_white_at_zero_and_darkens_to_both_ends() {
        assert_eq!(signed(0.5), (255, 255, 255));
        let at = |step: i32| luminance(signed(0.5 + 0.05 * f64::from(step)));
        for step in 0..10 {
            assert!(at(step) > at(step + 1) && at(-step) > at(-step - 1), "{step}");
            // Both signs equally dark, so that neither stands out in grey.
            assert!((at(step) - at(-step)).abs() < 0.12, "{step}: {} {}", at(step), at(-step));
        }
        let blue_leads = |(red, _, blue): (u8, u8, u8)| blue > red;
        assert!(blue_leads(signed(0.2)) && !blue_leads(signed(0.8)));
    }
}
