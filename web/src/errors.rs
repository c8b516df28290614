//! What the device reports later, as JavaScript promises: errors, and the end of submitted work.

use aonet::gpu::wgpu;
use futures_channel::{mpsc, oneshot};
use futures_util::StreamExt;
use futures_util::lock::Mutex;
use std::rc::Rc;
use std::sync::Arc;
use wasm_bindgen::JsValue;
use wasm_bindgen_futures::future_to_promise;

/// Error messages of a device.
pub(crate) struct DeviceErrors(Rc<Mutex<mpsc::UnboundedReceiver<String>>>);

impl DeviceErrors {
    /// Listens to a device.
    pub(crate) fn of(device: &wgpu::Device) -> Self {
        let (send, receive) = mpsc::unbounded();
        let lost = send.clone();
        // Sending fails when the page is gone: nobody listens any more.
        device.set_device_lost_callback(move |_, why| {
            let _ = lost.unbounded_send(format!("lost: {why}"));
        });
        device.on_uncaptured_error(Arc::new(move |error| {
            let _ = send.unbounded_send(error.to_string());
        }));
        Self(Rc::new(Mutex::new(receive)))
    }

    /// A promise of the next message.
    pub(crate) fn next(&self) -> js_sys::Promise {
        let receive = Rc::clone(&self.0);
        future_to_promise(async move {
            let message = receive.lock().await.next().await;
            Ok(message.map_or(JsValue::UNDEFINED, JsValue::from))
        })
    }
}

/// A promise that resolves when all submitted work has ended.
pub(crate) fn end_of(queue: &wgpu::Queue) -> js_sys::Promise {
    let (send, receive) = oneshot::channel();
    queue.on_submitted_work_done(move || {
        let _ = send.send(());
    });
    future_to_promise(async move {
        // A lost device does not call back; it has reported the loss already.
        let _ = receive.await;
        Ok(JsValue::UNDEFINED)
    })
}
