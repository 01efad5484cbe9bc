//! The tree in which a plot's channels are ticked.

use crate::channel::{Channel, Group, Id};
use crate::history::History;
use eframe::egui::{self, Button, CollapsingHeader, Rect, RichText, ScrollArea, TextEdit, Ui};

/// Width of the tree, points.
const WIDTH: f32 = 330.0;
/// Height at which it scrolls, points.
const HEIGHT: f32 = 340.0;

/// Whether a channel is found by what is typed: each word is somewhere in its name, group, unit or help.
fn found(channel: &Channel, search: &str) -> bool {
    let text = [channel.name, channel.group.name(), channel.unit, channel.help].join(" ").to_lowercase();
    search.to_lowercase().split_whitespace().all(|word| text.contains(word))
}

/// Shows the tree; `just_opened` puts the keyboard into the search field.
pub(super) fn show(ui: &mut Ui, channels: &mut Vec<Id>, history: &History, search: &mut String, just_opened: bool) {
    ui.set_width(WIDTH);
    let field = TextEdit::singleline(search).hint_text("Search name, group or meaning").desired_width(f32::INFINITY);
    let field = ui.add(field).accessible_name("Search channels");
    if just_opened {
        field.request_focus();
    }
    ui.separator();
    ScrollArea::vertical().max_height(HEIGHT).min_scrolled_height(HEIGHT).auto_shrink([false, true]).show(ui, |ui| {
        let mut any = false;
        for group in Group::ALL {
            let members = Id::ALL.iter().copied().filter(|id| id.channel().group == group);
            let members: Vec<Id> = members.filter(|id| found(id.channel(), search)).collect();
            any |= !members.is_empty();
            if !members.is_empty() {
                branch(ui, group, &members, channels, history, search);
            }
        }
        if !any {
            ui.weak(format!("no channel is called, or about, “{}”", search.trim()));
        }
    });
}

fn branch(ui: &mut Ui, group: Group, members: &[Id], channels: &mut Vec<Id>, history: &History, search: &str) {
    // Before the first row nothing can be said to be unknown.
    let known = |id: Id| history.is_empty() || history.knows(id);
    let shown = members.iter().filter(|id| channels.contains(id)).count();
    let title = if shown > 0 { format!("{} ({shown})", group.name()) } else { group.name().into() };
    let title = RichText::new(title);
    let header = CollapsingHeader::new(if members.iter().any(|&id| known(id)) { title } else { title.weak() })
        .id_salt(group)
        .default_open(shown > 0)
        .open((!search.trim().is_empty()).then_some(true))
        .show(ui, |ui| {
            for &id in members {
                leaf(ui, id, known(id), channels);
            }
        })
        .header_response;
    let missing: Vec<Id> = members.iter().copied().filter(|&id| known(id) && !channels.contains(&id)).collect();
    let right = ui.max_rect().right() - 8.0;
    let place = Rect::from_x_y_ranges(right - 56.0..=right, header.rect.y_range());
    let add = ui.place(place, |ui: &mut Ui| {
        ui.add_enabled(!missing.is_empty(), Button::new("add all").small().frame_when_inactive(false))
    });
    let name = group.name();
    add.widget_info(|| {
        egui::WidgetInfo::labeled(egui::Role::Button, !missing.is_empty(), format!("add all of {name}"))
    });
    if add.on_hover_text(format!("everything of “{name}” into this plot")).clicked() {
        channels.extend(missing);
    }
}

fn leaf(ui: &mut Ui, id: Id, known: bool, channels: &mut Vec<Id>) {
    let channel = id.channel();
    let mut ticked = channels.contains(&id);
    ui.horizontal(|ui| {
        // What is in the plot can be taken out of it, known or not.
        let name = RichText::new(channel.name).strong();
        let tick = ui.add_enabled(known || ticked, egui::Checkbox::new(&mut ticked, name));
        let help = if known { channel.help } else { "not known here" };
        ui.add(egui::Label::new(RichText::new(help).weak().size(11.5)).truncate().selectable(false));
        let unit = if channel.unit.is_empty() { String::new() } else { format!(", in {}", channel.unit) };
        let text = format!("{}: {}{unit}", channel.name, channel.help);
        let tick = tick.on_hover_text(&text).on_disabled_hover_text(format!("{text}\nnot known here"));
        if tick.changed() {
            if ticked {
                channels.push(id);
            } else {
                channels.retain(|&other| other != id);
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_looks_into_name_group_unit_and_help() {
        let all = |search: &str| -> Vec<&str> {
            let channels = Id::ALL.iter().map(|id| id.channel());
            channels.filter(|channel| found(channel, search)).map(|channel| channel.name).collect()
        };
        assert_eq!(all("omega"), ["omega", "phi"], "phi is the integral of omega");
        assert_eq!(all("TIME LOOP"), ["E_tle"], "in its help");
        assert_eq!(all("imu cylinder"), ["accC", "gyroC"], "a word of the group, a word of the help");
        assert_eq!(all("µs").len(), 3);
        assert_eq!(all("  ").len(), Id::ALL.len());
        assert!(all("no such thing").is_empty());
    }
}
