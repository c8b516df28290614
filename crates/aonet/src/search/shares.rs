//! Shares of a pixel's cosine-weighted light, by how a search classifies it.

use crate::frame::gbuffer::GBuffer;
use crate::frame::size::Size;

/// Upper bounds of the hidden shares: how far behind an occluder light passes, as a share of the AO radius. The last bound lies beyond
/// the radius.
pub const GAPS: [f32; 3] = [0.1, 0.3, 4.0];
/// Number of shares: hit, one hidden share for each of [`GAPS`], and off. The rest is open.
pub const SHARES: usize = GAPS.len() + 2;
/// What a search that reports shares writes for a pixel: the visibility, then the shares.
pub(crate) const PLANES: usize = SHARES + 1;

/// How a search classifies the light that comes to a pixel from within the AO radius, by what the G-buffer shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Share {
    /// It meets nothing, and passes behind nothing that is seen within the AO radius. What lies behind a thing that stands farther in
    /// front of the pixel's surface counts as open.
    Open,
    /// Something that is seen blocks it.
    Hit,
    /// It passes behind something that is seen, by less than 0.1 of the AO radius, and meets nothing that is seen.
    HiddenClose,
    /// The same by 0.1 to 0.3 of the AO radius.
    HiddenMiddle,
    /// The same by more.
    HiddenDeep,
    /// It leaves the frame.
    Off,
}

impl Share {
    /// All of them; those that are found come after the open one, as the planes of a search.
    pub const ALL: [Self; PLANES] =
        [Self::Open, Self::Hit, Self::HiddenClose, Self::HiddenMiddle, Self::HiddenDeep, Self::Off];

    /// Which plane of a search that reports shares holds it; the visibility stands where the open share, the rest, would.
    pub(crate) const fn search_plane(self) -> usize {
        self as usize
    }

    /// Its colour in pictures that mix all of them (sRGB): open is white, hit black, hidden orange (close) to yellow (deep), off blue.
    // Okabe and Ito 2008: also for people who see fewer colours.
    pub const fn colour(self) -> [u8; 3] {
        match self {
            Self::Open => [255; 3],
            Self::Hit => [0; 3],
            Self::HiddenClose => [213, 94, 0],
            Self::HiddenMiddle => [230, 159, 0],
            Self::HiddenDeep => [240, 228, 66],
            Self::Off => [0, 114, 178],
        }
    }

    /// Its name as a channel of a file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Hit => "hit",
            Self::HiddenClose => "hidden.close",
            Self::HiddenMiddle => "hidden.middle",
            Self::HiddenDeep => "hidden.deep",
            Self::Off => "off",
        }
    }
}

/// Shares of the cosine-weighted light of every pixel of a picture: in [0, 1], and 1 in all; the background is open. Not filtered.
///
/// Visibility lies between the open share and 1 minus the hit share, up to the noise of the taps.
#[derive(Debug, Clone, PartialEq)]
pub struct Shares {
    size: Size,
    /// Plane by plane, in the order of [`Share::ALL`].
    values: Vec<f32>,
}

impl Shares {
    /// The picture of what a search found: row by row of the buffer, plane by plane.
    pub(crate) fn of_picture(gbuffer: &GBuffer, found: &[f32]) -> Self {
        let (window, width) = (gbuffer.window(), gbuffer.width());
        let (size, margin) = (window.size(), window.margin());
        let mut values = vec![0.0; size.pixels() * PLANES];
        for i in 0..size.pixels() {
            let (x, y) = (i % size.width() + margin.x, i / size.width() + margin.y);
            let mut open = 1.0;
            for c in (0..SHARES).filter(|_| gbuffer.is_foreground(y * width + x)) {
                let share = found[(y * PLANES + c + 1) * width + x].clamp(0.0, 1.0);
                values[(c + 1) * size.pixels() + i] = share;
                open -= share;
            }
            values[i] = f32::max(open, 0.0);
        }
        Self { size, values }
    }

    /// Size of the picture (px).
    pub fn size(&self) -> Size {
        self.size
    }

    /// One share, HxW.
    pub fn plane(&self, share: Share) -> &[f32] {
        &self.values[share as usize * self.size.pixels()..][..self.size.pixels()]
    }
}
