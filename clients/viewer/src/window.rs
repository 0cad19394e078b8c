//! A window on a model.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use gpu::Gpu;
use render::{Coloring, DepthBuffer, Target};
use winit::application::ApplicationHandler;
use winit::dpi::{PhysicalPosition, PhysicalSize};
use winit::event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::keyboard::{Key, NamedKey};
use winit::window::{Fullscreen, Window, WindowId};

use crate::frame::{Frame, FrameRenderer};
use crate::screenshot;
use crate::shown::{Shown, Status};
use crate::{Look, ViewControl, ViewerError};

/// What keys do, for people.
pub const KEYS: &str = "\
Keys: F through the scope, R whole model, C colouring, S stereo, P picture to a file, F11 full screen, Q end;
arrows turn, + and - zoom. Mouse: left turns, right or middle moves, wheel zooms.";

/// How often it is looked whether what is shown has become stale.
const STATUS_INTERVAL: Duration = Duration::from_millis(100);
/// Pixels of a touch pad that make one step of a wheel.
const PIXELS_PER_STEP: f64 = 40.0;
/// A key turns as a drag over this share of the window's height does.
const KEY_TURN: f64 = 0.025;
const COLORINGS: [Coloring; 4] = [Coloring::Colour, Coloring::Shape, Coloring::Normal, Coloring::Confidence];

/// Sent by whoever has the model.
#[derive(Clone, Copy, Debug)]
pub enum ModelEvent {
    /// There is something new to draw.
    Changed,
    /// There will be nothing any more: the window closes.
    Ended,
}

/// How a window starts.
#[derive(Clone, Debug)]
pub struct WindowOptions {
    /// Above the window.
    pub title: String,
    /// Columns, rows.
    pub size_px: (u32, u32),
    /// Without a frame, on the whole screen.
    pub full_screen: bool,
    /// Where pictures go.
    pub pictures: PathBuf,
}

/// The loop that a window lives in; its proxy is for those who change the model.
///
/// # Errors
/// [`ViewerError::Window`] where there is no display.
pub fn event_loop() -> Result<(EventLoop<ModelEvent>, EventLoopProxy<ModelEvent>), ViewerError> {
    let built = EventLoop::<ModelEvent>::with_user_event().build();
    let events = built.map_err(|error| ViewerError::Window(error.to_string()))?;
    let proxy = events.create_proxy();
    Ok((events, proxy))
}

/// Shows a model until the window is closed. On the main thread.
///
/// # Errors
/// [`ViewerError`].
pub fn run(
    events: EventLoop<ModelEvent>,
    gpu: Arc<Gpu>,
    shown: impl Shown,
    (view, look): (ViewControl, Look),
    options: WindowOptions,
) -> Result<(), ViewerError> {
    let mut viewer = Viewer {
        gpu,
        shown,
        view,
        look,
        options,
        open: None,
        status: Status::default(),
        pointer: Pointer::default(),
        failure: None,
    };
    let ran = events.run_app(&mut viewer).map_err(|error| ViewerError::Window(error.to_string()));
    viewer.failure.map_or(ran, Err)
}

struct Viewer<S> {
    gpu: Arc<Gpu>,
    shown: S,
    view: ViewControl,
    look: Look,
    options: WindowOptions,
    open: Option<OpenWindow>,
    /// As it was last drawn.
    status: Status,
    pointer: Pointer,
    failure: Option<ViewerError>,
}

/// Where the mouse is, and what it holds.
#[derive(Debug, Default)]
struct Pointer {
    at: Option<PhysicalPosition<f64>>,
    turning: bool,
    panning: bool,
}

/// A window and what is drawn into it.
struct OpenWindow {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    depth: DepthBuffer,
    frames: FrameRenderer,
}

impl OpenWindow {
    fn new(gpu: &Arc<Gpu>, events: &ActiveEventLoop, options: &WindowOptions) -> Result<Self, ViewerError> {
        let refused = |error: String| ViewerError::Window(error);
        let size = PhysicalSize::new(options.size_px.0, options.size_px.1);
        let attributes = Window::default_attributes().with_title(options.title.clone()).with_inner_size(size);
        let full_screen = options.full_screen.then_some(Fullscreen::Borderless(None));
        let window = events
            .create_window(attributes.with_fullscreen(full_screen))
            .map_err(|error| refused(error.to_string()))?;
        let window = Arc::new(window);
        let surface =
            gpu.instance().create_surface(Arc::clone(&window)).map_err(|error| refused(error.to_string()))?;
        let size = window.inner_size();
        let mut config = surface
            .get_default_config(gpu.adapter(), size.width.max(1), size.height.max(1))
            .ok_or_else(|| refused(format!("{} cannot draw into it", gpu.description().name)))?;
        config.format = config.format.remove_srgb_suffix();
        config.present_mode = wgpu::PresentMode::Fifo;
        surface.configure(gpu.device(), &config);
        let depth = DepthBuffer::new(gpu, (config.width, config.height));
        let frames = FrameRenderer::new(gpu, config.format)?;
        Ok(Self { window, surface, config, depth, frames })
    }

    fn size_px(&self) -> (u32, u32) {
        (self.config.width, self.config.height)
    }

    fn resize(&mut self, gpu: &Gpu, size: PhysicalSize<u32>) {
        if size.width == 0 || size.height == 0 {
            return;
        }
        (self.config.width, self.config.height) = (size.width, size.height);
        self.surface.configure(gpu.device(), &self.config);
        self.depth = DepthBuffer::new(gpu, self.size_px());
    }

    /// Draws where there is something to draw into; a frame that cannot be shown is followed by another.
    fn draw(&mut self, gpu: &Gpu, shown: &impl Shown, frame: &Frame) -> Result<(), ViewerError> {
        use wgpu::CurrentSurfaceTexture as Current;
        let texture = match self.surface.get_current_texture() {
            Current::Success(texture) | Current::Suboptimal(texture) => texture,
            Current::Occluded | Current::Timeout => return Ok(()),
            Current::Outdated | Current::Lost | Current::Validation => {
                gpu.health()?;
                self.surface.configure(gpu.device(), &self.config);
                self.window.request_redraw();
                return Ok(());
            }
        };
        let color = texture.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let target = Target { color: &color, depth: &self.depth };
        let target = (target, (self.config.width, self.config.height));
        let mut drawn = Ok(());
        shown.in_turn(&mut || drawn = self.frames.draw(target, frame));
        drawn?;
        gpu.queue().present(texture);
        Ok(())
    }
}

impl<S: Shown> Viewer<S> {
    fn redraw(&mut self) -> Result<(), ViewerError> {
        let Some(open) = &mut self.open else { return Ok(()) };
        self.status = self.shown.status(Instant::now());
        if let Some(bounds) = &self.status.bounds {
            self.view.model_is_at(bounds);
        }
        let (arrays, weight_max) = (self.shown.arrays(&self.gpu)?, self.shown.weight_max());
        let frame = Frame {
            view: &self.view,
            look: &self.look,
            status: &self.status,
            surfels: (&arrays, weight_max),
        };
        open.draw(&self.gpu, &self.shown, &frame)
    }

    /// What is seen now, to the file that was named.
    fn take_picture(&mut self) -> Result<(), ViewerError> {
        let Some(open) = &self.open else { return Ok(()) };
        let (arrays, weight_max) = (self.shown.arrays(&self.gpu)?, self.shown.weight_max());
        let frame = Frame {
            view: &self.view,
            look: &self.look,
            status: &self.status,
            surfels: (&arrays, weight_max),
        };
        let mut drawn = None;
        self.shown.in_turn(&mut || drawn = Some(screenshot::draw(&self.gpu, open.size_px(), &frame)));
        drawn.map_or(Ok(()), |picture| screenshot::write(&self.options.pictures, &picture?))
    }

    fn press(&mut self, key: &Key, events: &ActiveEventLoop) {
        match key.as_ref() {
            Key::Named(NamedKey::ArrowLeft) => self.view.turn(-KEY_TURN, 0.0),
            Key::Named(NamedKey::ArrowRight) => self.view.turn(KEY_TURN, 0.0),
            Key::Named(NamedKey::ArrowUp) => self.view.turn(0.0, -KEY_TURN),
            Key::Named(NamedKey::ArrowDown) => self.view.turn(0.0, KEY_TURN),
            Key::Named(NamedKey::F11) => self.toggle_full_screen(),
            Key::Named(NamedKey::Escape) | Key::Character("q" | "Q") => events.exit(),
            Key::Character("+" | "=") => self.view.zoom(1.0),
            Key::Character("-") => self.view.zoom(-1.0),
            Key::Character("f" | "F") => self.view.toggle_follow(),
            Key::Character("r" | "R") => self.view.reset(),
            Key::Character("s" | "S") => self.look.stereo = self.look.stereo.next(),
            Key::Character("c" | "C") => self.look.coloring = next_coloring(self.look.coloring),
            Key::Character("p" | "P") => {
                // A disk that is full must not end the view.
                if let Err(error) = self.take_picture() {
                    tracing::error!(%error, "no picture");
                }
            }
            _ => {}
        }
    }

    fn toggle_full_screen(&self) {
        if let Some(open) = &self.open {
            let whole = open.window.fullscreen().is_none().then_some(Fullscreen::Borderless(None));
            open.window.set_fullscreen(whole);
        }
    }

    fn pointer_moves(&mut self, to: PhysicalPosition<f64>) {
        let from = self.pointer.at.replace(to).unwrap_or(to);
        let Some(open) = &self.open else { return };
        let height = f64::from(open.config.height);
        let (right, down) = ((to.x - from.x) / height, (to.y - from.y) / height);
        if self.pointer.turning {
            self.view.turn(right, down);
        } else if self.pointer.panning {
            self.view.pan(right, down);
        }
    }

    fn handle(&mut self, event: WindowEvent, events: &ActiveEventLoop) -> Result<(), ViewerError> {
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::RedrawRequested => return self.redraw(),
            WindowEvent::Resized(size) => {
                if let Some(open) = &mut self.open {
                    open.resize(&self.gpu, size);
                }
            }
            WindowEvent::KeyboardInput {
                event: KeyEvent { logical_key, state: ElementState::Pressed, .. },
                ..
            } => self.press(&logical_key, events),
            WindowEvent::MouseInput { state, button, .. } => {
                let pressed = state == ElementState::Pressed;
                match button {
                    MouseButton::Left => self.pointer.turning = pressed,
                    MouseButton::Right | MouseButton::Middle => self.pointer.panning = pressed,
                    _ => {}
                }
            }
            WindowEvent::CursorMoved { position, .. } => self.pointer_moves(position),
            WindowEvent::MouseWheel { delta, .. } => self.view.zoom(match delta {
                MouseScrollDelta::LineDelta(_, lines) => f64::from(lines),
                MouseScrollDelta::PixelDelta(pixels) => pixels.y / PIXELS_PER_STEP,
            }),
            _ => return Ok(()),
        }
        self.request_redraw();
        Ok(())
    }

    fn request_redraw(&self) {
        if let Some(open) = &self.open {
            open.window.request_redraw();
        }
    }

    fn end_on_failure(&mut self, done: Result<(), ViewerError>, events: &ActiveEventLoop) {
        if let Err(error) = done {
            self.failure.get_or_insert(error);
            events.exit();
        }
    }
}

fn next_coloring(shown: Coloring) -> Coloring {
    let place = COLORINGS.iter().position(|&coloring| coloring == shown).unwrap_or(0);
    COLORINGS[(place + 1) % COLORINGS.len()]
}

impl<S: Shown> ApplicationHandler<ModelEvent> for Viewer<S> {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        events.set_control_flow(ControlFlow::WaitUntil(Instant::now() + STATUS_INTERVAL));
        if self.open.is_none() {
            let opened = OpenWindow::new(&self.gpu, events, &self.options).map(|open| {
                open.window.request_redraw();
                self.open = Some(open);
            });
            self.end_on_failure(opened, events);
        }
    }

    fn user_event(&mut self, events: &ActiveEventLoop, event: ModelEvent) {
        match event {
            ModelEvent::Changed => self.request_redraw(),
            ModelEvent::Ended => events.exit(),
        }
    }

    /// Staleness is no event: it is looked for.
    fn new_events(&mut self, events: &ActiveEventLoop, cause: StartCause) {
        if matches!(cause, StartCause::ResumeTimeReached { .. }) {
            events.set_control_flow(ControlFlow::WaitUntil(Instant::now() + STATUS_INTERVAL));
            let now = self.shown.status(Instant::now());
            let drawn = &self.status;
            if (now.is_stale, now.is_hidden, &now.message)
                != (drawn.is_stale, drawn.is_hidden, &drawn.message)
            {
                self.request_redraw();
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _window: WindowId, event: WindowEvent) {
        let done = self.handle(event, events);
        self.end_on_failure(done, events);
    }
}
