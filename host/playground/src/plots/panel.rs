//! One plot: its legend, its controls and its curves.

use super::gesture::{self, Gesture};
use super::ink::inks;
use super::scale::{Scale, approach, value};
use super::time_axis::Ticks;
use super::{drop_down, names, picker};
use crate::channel::Id;
use crate::history::History;
use eframe::egui::{self, Align, Align2, Atom, Button, Color32, DragValue, FontId, Layout, Popup, PopupCloseBehavior};
use eframe::egui::{Pos2, Rect, RichText, SetOpenCommand, Stroke, StrokeKind, TextStyle, Ui, UiBuilder, vec2};
use egui_plot::{AxisHints, Line, LineStyle, Plot, PlotTransform};
use serde::{Deserialize, Serialize};

/// The least height of a plot with its legend, points.
pub(super) const LEAST: f32 = 92.0;
/// The least height of the curves, points.
const CURVES: f32 = 60.0;
/// Below this width the heading is left out and the controls are short, points.
const NARROW: f32 = 460.0;
/// Height of a row of the legend, points.
const ROW: f32 = 22.0;
/// Room for the numbers beside the vertical axis, points; wide enough for all of them, so that the plots are aligned.
const GUTTER: f32 = 58.0;

/// One plot of the stack.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub(super) struct Panel {
    #[serde(with = "names")]
    pub(super) channels: Vec<Id>,
    pub(super) scale: Scale,
    /// As dragged by hand, points; else it has its share of the room.
    pub(super) height: Option<f32>,
    /// Tells plots apart while others come and go; 0 before its first frame.
    #[serde(skip)]
    pub(super) key: u64,
    /// Whether its tree of channels opens in the next frame.
    #[serde(skip)]
    opens: bool,
    /// Edges of the scale in the last frame.
    #[serde(skip)]
    edges: Option<[f64; 2]>,
    /// What is typed into the search field.
    #[serde(skip)]
    search: String,
    /// The scale before a box was zoomed into.
    #[serde(skip)]
    unboxed: Option<Scale>,
    /// Where a box is being drawn from.
    #[serde(skip)]
    corner: Option<Pos2>,
}

/// What a plot is drawn with: the same for all of them.
pub(super) struct Scene<'a> {
    pub(super) history: &'a History,
    /// From when to when, s.
    pub(super) window: [f64; 2],
    /// Vertical lines of the grid.
    pub(super) ticks: Ticks,
    /// When the values of the legend are read, s; `None` for the newest.
    pub(super) read: Option<f64>,
    /// Time under the pointer, s.
    pub(super) hover: Option<f64>,
    /// Time that is scrubbed to, s.
    pub(super) cursor: Option<f64>,
    /// Whether all plots can be seen at once.
    pub(super) fits: bool,
}

/// What was done to a plot.
#[derive(Default)]
pub(super) struct Done {
    pub(super) closed: bool,
    /// A channel gets a plot of its own.
    pub(super) parted: Option<Id>,
    pub(super) gesture: Gesture,
    /// Where its curves are, left and right, points; none if it is out of sight.
    pub(super) sides: Option<egui::Rangef>,
}

impl Panel {
    pub(super) fn new(channels: &[Id], scale: Scale) -> Self {
        Panel { channels: channels.to_vec(), scale, ..Panel::default() }
    }

    /// An empty one, whose tree of channels opens at once.
    pub(super) fn opening() -> Self {
        Panel { opens: true, ..Panel::default() }
    }

    /// What it shows, in as few words as there are: “x”, “E_tle, E”, “omega (rad/s)”.
    pub(super) fn title(&self) -> String {
        let Some(first) = self.channels.first() else { return "Empty plot".into() };
        let stem = |id: &Id| id.channel().name.trim_end_matches(|c: char| c.is_ascii_digit());
        let name = if self.channels.len() > 1 && self.channels.iter().all(|id| stem(id) == stem(first)) {
            stem(first).into()
        } else {
            self.channels.iter().map(|id| id.channel().name).collect::<Vec<_>>().join(", ")
        };
        let unit = first.channel().unit;
        if !unit.is_empty() && self.channels.iter().all(|id| id.channel().unit == unit) {
            format!("{name} ({unit})")
        } else {
            name
        }
    }

    /// What stands over it, if that says more than the names in the legend do.
    fn heading(&self) -> Option<String> {
        let title = self.title();
        (!title.contains(',') && !self.channels.is_empty()).then_some(title)
    }

    /// Shows it over the whole width.
    pub(super) fn show(&mut self, ui: &mut Ui, height: f32, scene: &Scene<'_>) -> Done {
        let mut done = Done::default();
        let mut place = Rect::from_min_size(ui.cursor().min, vec2(ui.available_width(), height));
        let narrow = place.width() < NARROW;
        ui.push_id(("plot", self.key), |ui| {
            let controls = Rect::from_min_size(place.min, vec2(place.width(), ROW));
            let layout = Layout::right_to_left(Align::Center);
            let mut controls = ui.new_child(UiBuilder::new().id_salt("controls").max_rect(controls).layout(layout));
            self.controls(&mut controls, narrow, scene.history, &mut done);
            let room = (controls.min_rect().left() - place.left() - 6.0).max(60.0);
            let legend = Rect::from_min_size(place.min, vec2(room, ROW));
            let layout = Layout::left_to_right(Align::Center).with_main_wrap(true);
            let mut legend = ui.new_child(UiBuilder::new().id_salt("legend").max_rect(legend).layout(layout));
            self.legend(&mut legend, narrow, scene, &mut done);
            let top = legend.min_rect().bottom().max(controls.min_rect().bottom()) + 2.0;
            // A legend of many rows makes the plot higher.
            place.max.y = place.max.y.max(top + CURVES);
            let curves = Rect::from_min_max(egui::pos2(place.left(), top), place.max);
            if ui.is_rect_visible(curves) {
                let mut child = ui.new_child(UiBuilder::new().id_salt("curves").max_rect(curves));
                self.curves(&mut child, scene, &mut done);
            }
        });
        ui.advance_cursor_after_rect(place);
        done
    }

    fn controls(&mut self, ui: &mut Ui, narrow: bool, history: &History, done: &mut Done) {
        ui.spacing_mut().item_spacing.x = 3.0;
        let title = self.title();
        let close = control(ui, "×", format!("close {title}"));
        done.closed = close.on_hover_text("close this plot").clicked();
        let add = control(ui, if narrow { "+" } else { "+ channel" }, format!("channels of {title}"));
        let add = add.on_hover_text("choose what this plot shows");
        let opens = std::mem::take(&mut self.opens);
        let toggle = if opens { SetOpenCommand::Bool(true) } else { SetOpenCommand::Toggle };
        let just_opened = opens || add.clicked();
        if opens {
            add.scroll_to_me(None);
        }
        Popup::from_response(&add)
            .open_memory(just_opened.then_some(toggle))
            .close_behavior(PopupCloseBehavior::CloseOnClickOutside)
            .accessible_name("Channels")
            .show(|ui| picker::show(ui, &mut self.channels, history, &mut self.search, just_opened));
        self.scaling(ui, &title);
    }

    fn scaling(&mut self, ui: &mut Ui, title: &str) {
        let (text, fixed) = match self.scale {
            Scale::Auto => ("auto", self.edges.unwrap_or([-1.0, 1.0])),
            Scale::Log => ("log", [0.0, 1.0]),
            Scale::Fixed { min, max } => ("fixed", [min, max]),
        };
        // Edges as someone would type them.
        let [min, max] = fixed.map(|number| format!("{number:.2e}").parse().unwrap_or(number));
        let mut scale = self.scale;
        let button = control(ui, (text, drop_down()), format!("scale of {title}: {text}"));
        Popup::menu(&button).show(|ui| {
            ui.selectable_value(&mut scale, Scale::Auto, "auto: what is in sight fills the plot");
            ui.selectable_value(&mut scale, Scale::Log, "log: the logarithm of what is in sight does");
            if ui.selectable_label(text == "fixed", "fixed: from one number to another").clicked() {
                scale = Scale::Fixed { min, max };
            }
        });
        button.on_hover_text("vertical scale");
        if scale != self.scale {
            self.scale = scale;
            self.edges = None;
            self.unboxed = None;
        }
        if let Scale::Fixed { min, max } = &mut self.scale {
            let speed = 0.005 * (*max - *min).abs().max(1e-6);
            for (edge, name) in [(max, "upper"), (min, "lower")] {
                let field = ui.add(DragValue::new(edge).speed(speed).max_decimals(4));
                field.on_hover_text(format!("{name} edge of the scale of {title}"));
            }
        }
    }

    fn legend(&mut self, ui: &mut Ui, narrow: bool, scene: &Scene<'_>, done: &mut Done) {
        ui.spacing_mut().item_spacing = vec2(2.0, 0.0);
        if let Some(heading) = self.heading().filter(|_| !narrow) {
            ui.add(egui::Label::new(RichText::new(heading).strong()).selectable(false));
            ui.add_space(6.0);
        }
        if self.channels.is_empty() {
            ui.weak("“+ channel” chooses what it shows");
        }
        let mut removed = None;
        for (&id, (ink, dashed)) in self.channels.iter().zip(inks(&self.channels)) {
            let colour = ink.on(ui.visuals());
            let number = value(scene.history.number_at(id, scene.read));
            let swatch = Atom::paint(vec2(14.0, 10.0), move |ui, args| {
                let (left, right) = (args.rect.left_center(), args.rect.right_center());
                let stroke = Stroke::new(3.0, colour);
                if dashed {
                    ui.painter().extend(egui::Shape::dashed_line(&[left, right], stroke, 4.0, 3.0));
                } else {
                    ui.painter().line_segment([left, right], stroke);
                }
            });
            let channel = id.channel();
            // A fixed width, so that nothing jumps while numbers run.
            let number = RichText::new(format!("{number:>7}")).monospace();
            let chip = Button::new((swatch, channel.name, number)).small().frame_when_inactive(false).gap(4.0);
            let chip = ui.add(chip);
            Popup::menu(&chip).show(|ui| {
                ui.weak(channel.help);
                if ui.button(format!("Remove {}", channel.name)).clicked() {
                    removed = Some(id);
                }
                if ui.button(format!("Move {} to a plot of its own", channel.name)).clicked() {
                    (removed, done.parted) = (Some(id), Some(id));
                }
            });
            let unit = if channel.unit.is_empty() { String::new() } else { format!(", in {}", channel.unit) };
            chip.on_hover_text(format!("{}: {}{unit}", channel.name, channel.help));
        }
        self.channels.retain(|&id| Some(id) != removed);
    }

    fn curves(&mut self, ui: &mut Ui, scene: &Scene<'_>, done: &mut Done) {
        let [from, to] = scene.window;
        let target = self.scale.edges(scene.history, &self.channels, scene.window);
        let dt = f64::from(ui.input(|input| input.stable_dt)).min(0.1);
        let (edges, moving) = match (self.edges, self.scale) {
            (Some(shown), Scale::Auto | Scale::Log) => approach(shown, target, dt),
            _ => (target, false),
        };
        self.edges = Some(edges);
        if moving {
            ui.request_repaint();
        }
        let scale = self.scale;
        let small = FontId::proportional(TextStyle::Small.resolve(ui.style()).size.max(10.0));
        let axis = AxisHints::new_y().min_thickness(GUTTER).tick_label_font(small).label_spacing(1.0..=2.0);
        let axis = axis.tick_label_color(ui.visuals().text_color()).formatter(move |mark, _| scale.label(mark));
        let ticks = scene.ticks;
        let height = ui.available_height();
        let plot = Plot::new("curves")
            .show_axes([false, true])
            .custom_y_axes(vec![axis])
            .x_grid_spacer(move |_| ticks.marks([from, to]))
            .y_grid_spacer(move |_| scale.marks(edges, height))
            // Every line is as faint as the others.
            .grid_spacing(1.0..=2.0)
            .grid_color(ui.visuals().text_color().gamma_multiply(0.22))
            .show_x(false)
            .show_y(false)
            .allow_axis_zoom_drag(false)
            .allow_boxed_zoom(false)
            .allow_double_click_reset(false)
            .allow_drag(false)
            .allow_scroll(false)
            .allow_zoom(false)
            .set_margin_fraction(egui::Vec2::ZERO);
        let pixels = ((ui.available_width() - GUTTER).max(1.0) * ui.pixels_per_point()) as usize;
        let inks = inks(&self.channels);
        let visuals = ui.visuals().clone();
        let channels = &self.channels;
        let shown = plot.show(ui, |plot| {
            plot.set_plot_bounds(egui_plot::PlotBounds::from_min_max([from, edges[0]], [to, edges[1]]));
            for (&id, &(ink, dashed)) in channels.iter().zip(&inks) {
                let mut points = scene.history.window(id, from, to, pixels);
                for [_, number] in &mut points {
                    *number = scale.height(*number);
                }
                let style = if dashed { LineStyle::dashed_dense() } else { LineStyle::Solid };
                for run in points.split(|[_, number]| number.is_nan()).filter(|run| !run.is_empty()) {
                    let line = Line::new(id.channel().name, run.to_vec());
                    plot.line(line.color(ink.on(&visuals)).width(1.4).style(style));
                }
            }
        });
        let (response, transform) = (shown.response, shown.transform);
        let title = self.title();
        response
            .widget_info(|| egui::WidgetInfo::labeled(egui::Role::GraphicsObject, true, format!("Plot of {title}")));
        self.overlay(ui, scene, &response, &transform);
        done.sides = Some(transform.frame().x_range());
        done.gesture = gesture::of(ui, &response, &transform, &mut self.corner, scene.fits);
        if let Some([min, max]) = done.gesture.boxed_heights.take().filter(|_| scale != Scale::Log) {
            self.unboxed.get_or_insert(scale);
            self.scale = Scale::Fixed { min, max };
        }
        if done.gesture.live
            && let Some(scale) = self.unboxed.take()
        {
            self.scale = scale;
        }
    }

    /// What is drawn over the curves: the cursors, the box that is being drawn, the frame of the focus.
    fn overlay(&self, ui: &Ui, scene: &Scene<'_>, response: &egui::Response, transform: &PlotTransform) {
        let frame = *transform.frame();
        let painter = ui.painter().with_clip_rect(frame.expand(1.0).intersect(ui.clip_rect()));
        let vertical = |t: f64, stroke: Stroke| {
            painter.vline(transform.position_from_point_x(t), frame.y_range(), stroke);
        };
        let visuals = ui.visuals();
        if let Some(t) = scene.cursor {
            vertical(t, Stroke::new(2.0, visuals.selection.stroke.color));
        }
        if let Some(t) = scene.hover {
            vertical(t, Stroke::new(1.0, visuals.strong_text_color()));
        }
        if let (Some(corner), Some(pointer)) = (self.corner, response.hover_pos()) {
            let area = gesture::area(corner, pointer, frame);
            painter.rect(
                area,
                0.0,
                visuals.selection.bg_fill.gamma_multiply(0.3),
                visuals.selection.stroke,
                StrokeKind::Inside,
            );
        }
        if response.has_focus() {
            painter.rect_stroke(frame, 2.0, Stroke::new(1.5, visuals.selection.stroke.color), StrokeKind::Inside);
        }
        if !self.channels.is_empty() && !scene.history.is_empty() {
            let unknown: Vec<&str> =
                self.channels.iter().filter(|id| !scene.history.knows(**id)).map(|id| id.channel().name).collect();
            if unknown.len() == self.channels.len() {
                let text = format!("{} not known here", unknown.join(", "));
                let font = TextStyle::Body.resolve(ui.style());
                painter.text(frame.center(), Align2::CENTER_CENTER, text, font, visuals.weak_text_color());
            }
        }
    }
}

/// A small button, with its name for those who do not see it.
fn control<'a>(ui: &mut Ui, content: impl egui::IntoAtoms<'a>, name: String) -> egui::Response {
    let response = ui.add(Button::new(content).small().frame_when_inactive(false));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &name));
    response
}

/// Marks where a plot's height is dragged: a thin bar below it. Its height follows, or goes back to its share.
pub(super) fn splitter(ui: &mut Ui, panel: &mut Panel, height: f32) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 7.0), egui::Sense::click_and_drag());
    let title = panel.title();
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Splitter, true, format!("height of {title}")));
    let colour = if response.hovered() || response.dragged() || response.has_focus() {
        ui.visuals().selection.stroke.color
    } else {
        Color32::TRANSPARENT
    };
    ui.painter().hline(rect.x_range(), rect.center().y, Stroke::new(2.0, colour));
    let mut by = response.drag_delta().y;
    if response.has_focus() {
        let filter = egui::EventFilter { vertical_arrows: true, ..egui::EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        let presses = |key| ui.input(|input| input.num_presses(key)) as f32;
        by += 10.0 * (presses(egui::Key::ArrowDown) - presses(egui::Key::ArrowUp));
    }
    if by != 0.0 {
        panel.height = Some((height + by).max(LEAST));
    }
    if response.double_clicked() {
        panel.height = None;
    }
    response.on_hover_cursor(egui::CursorIcon::ResizeVertical).on_hover_text("drag: height; double click: its share");
}
