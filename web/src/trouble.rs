//! What the device tells later, as promises of the page.

use aonet::gpu::wgpu;
use futures_channel::{mpsc, oneshot};
use futures_util::StreamExt;
use futures_util::lock::Mutex;
use std::rc::Rc;
use std::sync::Arc;
use wasm_bindgen::JsValue;
use wasm_bindgen_futures::future_to_promise;

/// Sentences about what went wrong on a device.
pub(crate) struct Trouble(Rc<Mutex<mpsc::UnboundedReceiver<String>>>);

impl Trouble {
    /// Listens to a device.
    pub(crate) fn of(device: &wgpu::Device) -> Self {
        let (send, receive) = mpsc::unbounded();
        let lost = send.clone();
        // Nobody listens any more when the page is gone.
        device.set_device_lost_callback(move |_, why| {
            let _ = lost.unbounded_send(format!("lost: {why}"));
        });
        device.on_uncaptured_error(Arc::new(move |error| {
            let _ = send.unbounded_send(error.to_string());
        }));
        Self(Rc::new(Mutex::new(receive)))
    }

    /// A promise of the next sentence.
    pub(crate) fn next(&self) -> js_sys::Promise {
        let receive = Rc::clone(&self.0);
        future_to_promise(async move {
            let sentence = receive.lock().await.next().await;
            Ok(sentence.map_or(JsValue::UNDEFINED, JsValue::from))
        })
    }
}

/// A promise of the end of all that has been submitted.
pub(crate) fn end_of(queue: &wgpu::Queue) -> js_sys::Promise {
    let (send, receive) = oneshot::channel();
    queue.on_submitted_work_done(move || {
        let _ = send.send(());
    });
    future_to_promise(async move {
        // A lost device does not call back; it has told so already.
        let _ = receive.await;
        Ok(JsValue::UNDEFINED)
    })
}
