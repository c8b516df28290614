//! One line of text in a picture: an 8x8 bitmap font, doubled twice with smooth diagonals, then averaged down to
//! two thirds of its width.

use font8x8::{BASIC_FONTS, LATIN_FONTS, UnicodeFonts};
use image::{Rgb, RgbImage};

/// Height of a line (px).
pub(super) const LINE: u32 = 16;

/// Space between letters and width of a blank (px).
const SPACING: u32 = 2;
const BLANK: u32 = 6;

/// Dots that a pixel covers, across and down.
const ACROSS: usize = 3;
const DOWN: usize = 2;

/// Square of lit and unlit dots.
type Dots = Vec<Vec<bool>>;

/// Dots of a character at four times the font's size; empty columns at its sides are cut off.
fn glyph(c: char) -> Dots {
    let rows = BASIC_FONTS.get(c).or_else(|| LATIN_FONTS.get(c)).unwrap_or([0x7e; 8]);
    let used = rows.iter().fold(0, |all, row| all | row);
    let columns = used.trailing_zeros()..8 - used.leading_zeros();
    let dots = rows.iter().map(|row| columns.clone().map(|bit| row >> bit & 1 == 1).collect()).collect();
    doubled(&doubled(&dots))
}

/// Twice the size; corners of diagonals are filled or cut.
// Scale2x, Mazzoleni 2001.
fn doubled(dots: &Dots) -> Dots {
    let (height, width) = (dots.len(), dots[0].len());
    let at = |y: usize, x: usize| y < height && x < width && dots[y][x];
    let quarter = |y: usize, x: usize| {
        let (cy, cx) = (y / 2, x / 2);
        let (up, down) = (at(cy.wrapping_sub(1), cx), at(cy + 1, cx));
        let (left, right) = (at(cy, cx.wrapping_sub(1)), at(cy, cx + 1));
        let (near_y, far_y) = if y.is_multiple_of(2) { (up, down) } else { (down, up) };
        let (near_x, far_x) = if x.is_multiple_of(2) { (left, right) } else { (right, left) };
        if near_x == near_y && near_x != far_y && near_y != far_x { near_x } else { at(cy, cx) }
    };
    (0..2 * height).map(|y| (0..2 * width).map(|x| quarter(y, x)).collect()).collect()
}

/// Width of a text (px).
pub(super) fn width(text: &str) -> u32 {
    text.chars().map(advance).sum()
}

fn advance(c: char) -> u32 {
    if c == ' ' { BLANK } else { glyph(c)[0].len().div_ceil(ACROSS) as u32 + SPACING }
}

/// Writes `text` from its top left corner; the part that does not fit is cut off.
pub(super) fn draw(picture: &mut RgbImage, (mut left, top): (u32, u32), text: &str, colour: [u8; 3]) {
    for c in text.chars() {
        if c != ' ' {
            draw_glyph(picture, (left, top), &glyph(c), colour);
        }
        left += advance(c);
    }
}

fn draw_glyph(picture: &mut RgbImage, (left, top): (u32, u32), dots: &Dots, colour: [u8; 3]) {
    for (y, rows) in dots.chunks_exact(DOWN).enumerate() {
        for x in 0..dots[0].len().div_ceil(ACROSS) {
            let lit =
                rows.iter().flat_map(|row| row.iter().skip(x * ACROSS).take(ACROSS)).filter(|d| **d).count();
            let cover = lit as f32 / (ACROSS * DOWN) as f32;
            if let Some(Rgb(below)) = picture.get_pixel_mut_checked(left + x as u32, top + y as u32) {
                for (b, c) in below.iter_mut().zip(colour) {
                    *b = (f32::from(*b) * (1.0 - cover) + f32::from(c) * cover).round() as u8;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_as_wide_as_it_says_and_is_cut_at_the_edge() {
        let text = "Wi ±1.5 \u{4e00}";
        let mut wide = RgbImage::new(200, LINE);
        draw(&mut wide, (0, 0), text, [255; 3]);
        let lit = |p: &RgbImage| p.enumerate_pixels().filter(|(.., p)| p.0 != [0; 3]).map(|(x, ..)| x).max();
        assert_eq!(lit(&wide).unwrap() + 1 + SPACING, width(text));
        let mut narrow = RgbImage::new(10, LINE);
        draw(&mut narrow, (0, 0), text, [255; 3]);
        assert!(narrow.pixels().zip(wide.pixels()).next().is_some_and(|(a, b)| a == b));
        assert!(width("i") < width("W"));
    }

    #[test]
    fn doubling_keeps_boxes_and_smooths_diagonals() {
        let solid = vec![vec![true; 3]; 3];
        // A corner of a box is a diagonal to the outside: rounded.
        let lit = |d: &Dots| d.iter().flatten().filter(|b| **b).count();
        assert_eq!(lit(&doubled(&solid)), 36 - 4);
        let diagonal = vec![vec![true, false], vec![false, true]];
        assert_eq!(lit(&doubled(&diagonal)), 8 + 2);
    }
}
