//! Classic methods as programs.

use super::{agtao, arcs, bent, denoise, gtao, hbao, pixels, shares, ssao, ssdo, surfels, vbao};
use crate::error::{Error, Result};
use crate::frame::size::Size;
use crate::gpu::image::{Image, Raw};
use crate::gpu::options::{BentEncoding, Precision, TextureEncoding};
use crate::gpu::program::{Arithmetic, Binding, BufferId, Describe, Dispatches, Grid, Program, Template};
use crate::gpu::shader::Shader;
use crate::gpu::surface::Surface;
use crate::search::gpu::hemisphere;
use crate::search::gpu::pyramid::Pyramid;
use crate::search::{ArcsParams, BEND, Classic, PLANES};

/// A classic method that describes its programs. They compute in 32-bit floats. NNAO has no shaders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Method {
    method: Classic,
    surface: Surface,
    picture: Picture,
}

/// What a program draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Picture {
    Visibility,
    Shares,
    /// Visibility, and bent normals in a picture of their own.
    BentNormals(BentEncoding),
}

impl Picture {
    /// Values that the search of a method writes for a pixel.
    fn planes(self, method: &Classic) -> usize {
        match self {
            Self::Visibility => 1,
            Self::Shares => PLANES,
            Self::BentNormals(_) => method.planes() + BEND,
        }
    }
}

impl Method {
    /// A method for frames whose textures hold this.
    ///
    /// # Errors
    /// When the method is NNAO or a parameter is out of its range.
    pub fn new(method: &Classic, textures: TextureEncoding) -> Result<Self> {
        Self::drawing(Picture::Visibility, method, textures)
    }

    /// Connected arcs whose picture is not the visibility but the shares of light that they find, before any filter, as a mixture
    /// of the colours [`Share::colour`](crate::search::Share::colour): to see what a frame shows and what it hides.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn shares(params: &ArcsParams, textures: TextureEncoding) -> Result<Self> {
        Self::drawing(Picture::Shares, &Classic::Arcs(*params), textures)
    }

    /// A method that draws bent normals as well.
    ///
    /// # Errors
    /// As [`Method::new`], and when the method has none.
    pub fn with_bent_normals(
        method: &Classic,
        textures: TextureEncoding,
        encoding: BentEncoding,
    ) -> Result<Self> {
        method.check_bent_normals()?;
        Self::drawing(Picture::BentNormals(encoding), method, textures)
    }

    fn drawing(picture: Picture, method: &Classic, textures: TextureEncoding) -> Result<Self> {
        let (method, surface) = (method.checked()?, Surface { precision: Precision::F32, textures });
        shader(surface, &method, picture.planes(&method))?;
        Ok(Self { method, surface, picture })
    }

    /// Adds the dispatches that fill `found`.
    fn push_search(&self, found: BufferId, list: &mut Dispatches) -> Result<()> {
        let mut bindings = vec![Binding::Write(found)];
        match &self.method {
            Classic::Ssao(params) => {
                bindings.push(Binding::Read(hemisphere::buffer(&ssao::samples(params), list)));
            }
            Classic::Ssdo(params) => {
                bindings.push(Binding::Read(hemisphere::buffer(&ssdo::samples(params), list)));
            }
            Classic::Gtao(params) => {
                let pyramid = Pyramid::new(list);
                pyramid.push(self.surface, params, list);
                bindings.extend(pyramid.bindings());
            }
            Classic::Arcs(_) => bindings.extend(surfels::push(self.surface, list)),
            Classic::Hbao(_) | Classic::Vbao(_) | Classic::Agtao(_) | Classic::Nnao(_) => {}
        }
        let shader = shader(self.surface, &self.method, self.picture.planes(&self.method))?;
        pixels::push(self.method.name(), shader, &bindings, list);
        Ok(())
    }

    /// The programs of every size.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn template(&self) -> Result<Template> {
        let (surface, mut list) = (self.surface, Dispatches::default());
        let planes = self.picture.planes(&self.method);
        let bytes = Grid::FRAME.count() * (planes * size_of::<f32>()).into();
        let buffers = [(); 2].map(|()| list.storage("found", bytes.clone()));
        self.push_search(buffers[0], &mut list)?;
        let filter = self.method.denoise();
        let passes = match self.picture {
            Picture::Visibility | Picture::BentNormals(_) => filter.passes().collect(),
            Picture::Shares => vec![],
        };
        for (i, pass) in passes.iter().enumerate() {
            let way = [buffers[i % 2], buffers[(i + 1) % 2]];
            denoise::push(denoise::shader(surface, (filter, *pass), planes), way, &mut list);
        }
        let found = buffers[passes.len() % 2];
        let image = match self.picture {
            Picture::Visibility | Picture::BentNormals(_) => {
                Image { raw: Raw::Pixels(found), patch: 1, cells: Grid::FRAME, base: None }
                    .draw(surface, &mut list)
            }
            Picture::Shares => shares::draw(found, surface, &mut list),
        };
        let bent = match self.picture {
            Picture::BentNormals(encoding) => Some(bent::draw((found, planes), encoding, surface, &mut list)),
            Picture::Visibility | Picture::Shares => None,
        };
        let (textures, arithmetic) = (surface.textures, Arithmetic::PLAIN);
        Ok(Template { textures, arithmetic, dispatches: list, image, bent, trusted: true })
    }
}

impl Describe for Method {
    fn program(&self, size: Size) -> Result<Program> {
        self.template()?.at(size)
    }
}

/// The shader of a method's search, before its filter; only arcs, and methods with bent normals, write more than one plane.
///
/// # Errors
/// When it has none.
fn shader(surface: Surface, method: &Classic, planes: usize) -> Result<Shader> {
    Ok(match method {
        Classic::Ssao(params) => ssao::shader(surface, params),
        Classic::Hbao(params) => hbao::shader(surface, params),
        Classic::Ssdo(params) => ssdo::shader(surface, params),
        Classic::Gtao(params) => gtao::shader(surface, params, planes),
        Classic::Vbao(params) => vbao::shader(surface, params),
        Classic::Agtao(params) => agtao::shader(surface, params, planes),
        Classic::Arcs(params) => arcs::shader(surface, params, planes),
        Classic::Nnao(_) => {
            let expected = "ssao, hbao, ssdo, gtao, vbao, agtao or arcs";
            return Err(Error::value("method on a graphics device", expected, method.name()));
        }
    })
}

#[cfg(all(test, feature = "gpu"))]
mod tests {
    use super::*;
    use crate::gpu::image::covering;
    use crate::net::gpu::valid::{PRECISIONS, encodings, validate};
    use crate::search::gpu::pyramid;
    use crate::search::{
        AgtaoParams, BENT_PLANES, BENT_SHARES, GtaoParams, KEEP, Pass, SsaoParams, VbaoParams,
    };

    /// Every branch that a parameter chooses.
    fn methods() -> impl Iterator<Item = Classic> {
        let all = Classic::all().into_iter().filter(|m| !matches!(m, Classic::Nnao(_)));
        all.chain([
            Classic::Gtao(GtaoParams { depth_levels: 1, ..GtaoParams::default() }),
            Classic::Vbao(VbaoParams { cosine: 1, ..VbaoParams::default() }),
            Classic::Ssao(SsaoParams { hemisphere: 0, ..SsaoParams::default() }),
        ])
    }

    #[test]
    fn every_shader_is_valid() {
        for precision in PRECISIONS {
            for textures in encodings() {
                let of = Surface { precision, textures };
                for method in methods() {
                    validate(shader(of, &method, 1).unwrap().source(), &format!("{method:?}"));
                    if method.has_bent_normals() {
                        let bent = shader(of, &method, method.planes() + BEND).unwrap();
                        validate(bent.source(), &format!("bent normals, {method:?}"));
                    }
                }
                validate(surfels::shader(of).source(), "surfels");
                validate(&covering(shares::shader(of).source()), "shares");
                for encoding in [BentEncoding::Plain, BentEncoding::Unorm] {
                    for planes in [BENT_PLANES, BENT_SHARES] {
                        validate(&covering(bent::shader(of, encoding, planes).source()), "bent normals");
                    }
                }
                validate(pyramid::shader(of, &GtaoParams::default()).source(), "pyramid");
                for planes in [1, BENT_PLANES, PLANES, BENT_SHARES] {
                    let filter = AgtaoParams::default().denoise();
                    for pass in [Pass::Smooth, Pass::Settle { keep: KEEP }] {
                        validate(denoise::shader(of, (filter, pass), planes).source(), "denoise");
                    }
                }
                validate(arcs::shader(of, &ArcsParams::default(), PLANES).source(), "arcs");
            }
        }
    }
}
