//! Sessions of methods, shared by cameras of the same size.

use crate::settings::AonetMethod;
use aonet::Size;
use aonet::gpu::{
    BoundFrame, DepthEncoding, FrameNumbers, FrameViews, Layers, NormalEncoding, NormalSpace, Options, wgpu,
};
use aonet::net::{Model, shipped};
use aonet::search::Classic;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use std::sync::{Arc, Weak};

/// A session of either kind.
#[derive(Debug)]
pub enum Engine {
    Network(aonet::net::gpu::Session),
    Search(aonet::search::gpu::ClassicSession),
}

/// What a session is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Key {
    pub method: AonetMethod,
    /// Width and height (px).
    pub size: UVec2,
    /// Format of its visibility.
    pub format: wgpu::TextureFormat,
    /// Whether its frames have a second layer of depth.
    pub is_deep: bool,
}

/// Sessions that cameras use, and the ones that could not be made.
#[derive(Resource, Debug, Default)]
pub struct Engines(HashMap<Key, Option<Weak<Engine>>>);

impl AonetMethod {
    /// The network's file.
    fn network(self) -> Option<&'static [u8]> {
        match self {
            Self::Gtao | Self::Agtao => None,
            Self::Fast => Some(shipped::FAST),
            Self::Balanced => Some(shipped::BALANCED),
            Self::High => Some(shipped::HIGH),
        }
    }

    /// The name of the search, with parameters tuned on training scenes.
    fn search(self) -> &'static str {
        match self {
            Self::Gtao => "gtao:tuned",
            Self::Agtao | Self::Fast | Self::Balanced | Self::High => "agtao:tuned",
        }
    }
}

impl Engine {
    fn new(on: (&wgpu::Device, &wgpu::Queue), key: Key) -> aonet::Result<Self> {
        let size = Size::named("viewport", key.size.x as usize, key.size.y as usize)?;
        let options = Options {
            normals: NormalEncoding::Unorm,
            normal_space: NormalSpace::World,
            depth: DepthEncoding::Reversed,
            output: key.format,
            layers: if key.is_deep { Layers::Two } else { Layers::One },
            ..Options::default()
        };
        Ok(match key.method.network() {
            Some(bytes) => {
                let model = Model::from_bytes(bytes)?;
                Self::Network(aonet::net::gpu::Session::new(on, &model, size, options)?)
            }
            None => {
                let method = Classic::named(key.method.search())?;
                Self::Search(aonet::search::gpu::ClassicSession::new(on, &method, size, options)?)
            }
        })
    }

    /// The same with other buffers; weights and shaders are shared.
    fn sibling(&self, size: UVec2) -> aonet::Result<Self> {
        let size = Size::named("viewport", size.x as usize, size.y as usize)?;
        Ok(match self {
            Self::Network(session) => Self::Network(session.sibling(size)?),
            Self::Search(session) => Self::Search(session.sibling(size)?),
        })
    }

    /// Binds textures and encodes a frame.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        views: FrameViews<'_>,
        frame: &FrameNumbers,
    ) -> aonet::Result<()> {
        let bound: BoundFrame;
        match self {
            Self::Network(session) => {
                bound = session.bind(views)?;
                session.encode(encoder, &bound, frame)
            }
            Self::Search(session) => {
                bound = session.bind(views)?;
                session.encode(encoder, &bound, frame)
            }
        }
    }

    fn memory_bytes(&self) -> u64 {
        match self {
            Self::Network(session) => session.memory_bytes(),
            Self::Search(session) => session.memory_bytes(),
        }
    }
}

impl Engines {
    /// The session of a key, made if there is none. One that could not be made is reported once and not tried again while a
    /// camera asks for it.
    pub fn get(&mut self, on: (&wgpu::Device, &wgpu::Queue), key: Key) -> Option<Arc<Engine>> {
        match self.0.get(&key) {
            Some(None) => return None,
            Some(Some(made)) if made.strong_count() > 0 => return made.upgrade(),
            _ => {}
        }
        let made = match self.relative(key) {
            Some(relative) => relative.sibling(key.size),
            None => Engine::new(on, key),
        };
        let made = match made {
            Ok(engine) => {
                info!(
                    "aonet: {:?} at {}x{}, {} MiB",
                    key.method,
                    key.size.x,
                    key.size.y,
                    engine.memory_bytes() >> 20
                );
                Some(Arc::new(engine))
            }
            Err(error) => {
                error!("aonet: {error}; the camera keeps Bevy's own ambient occlusion");
                None
            }
        };
        self.0.insert(key, made.as_ref().map(Arc::downgrade));
        made
    }

    /// A session of another size.
    fn relative(&self, key: Key) -> Option<Arc<Engine>> {
        let same = |other: &Key| Key { size: key.size, ..*other } == key;
        self.0.iter().filter(|(other, _)| same(other)).find_map(|(_, made)| made.as_ref()?.upgrade())
    }

    /// Forgets sessions that no camera holds.
    pub fn forget_unused(&mut self) {
        self.0.retain(|_, made| made.as_ref().is_none_or(|made| made.strong_count() > 0));
    }
}
