//! Pictures and films, as the window makes them: what a screen would show is made up here.

mod bench;

use bench::{Kept, Window, folder, frames, open, open_in, strike, until};
use eframe::App as _;
use eframe::egui::{Color32, ColorImage, Key, Vec2, ViewportCommand, ViewportId};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What the screen shows the n-th time: its left half of one colour and its right half of another, so that a picture that was
/// cut wrongly is told from one that was cut right.
fn screen(size: [usize; 2], n: usize) -> ColorImage {
    let [left, right] = [Color32::from_rgb(40 * (n % 6) as u8, 200, 0), Color32::from_rgb(0, 0, 255)];
    let pixels = (0..size[0] * size[1]).map(|i| if i % size[0] < size[0] / 2 { left } else { right }).collect();
    ColorImage::new(size, pixels)
}

/// Gives the window the pictures that it asked for in its last frame; how many those were.
fn develop(window: &Window, image: &ColorImage) -> usize {
    let commands = &window.output().viewport_output[&ViewportId::ROOT].commands;
    let asked = commands.iter().filter_map(|command| match command {
        ViewportCommand::Screenshot(callback) => Some(callback.clone()),
        _ => None,
    });
    asked.map(|callback| callback.complete(Arc::new(image.clone()))).count()
}

/// A session whose pictures land in its own folder of `runs`, and that folder.
fn live(window: &mut Window) -> PathBuf {
    until(window, "a log", |window| window.state().status().log.is_some() && window.state().history().len() > 2);
    let log = window.state().status().log.clone().expect("it was waited for");
    folder().join(log).parent().expect("it is in a folder").to_owned()
}

/// Goes on until the film has so many pictures more; when each was taken, at the earliest and at the latest.
fn shoot(window: &mut Window, size: [usize; 2], count: usize) -> Vec<[Instant; 2]> {
    let mut times = Vec::new();
    let start = Instant::now();
    while times.len() < count {
        assert!(start.elapsed() < Duration::from_secs(60), "{} of {count} pictures", times.len());
        let before = Instant::now();
        window.step();
        if develop(window, &screen(size, times.len())) > 0 {
            times.push([before, Instant::now()]);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    times
}

/// Names of the files in a folder, hidden ones too.
fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Names of the files in a folder that are shown to people.
fn shown(folder: &Path) -> Vec<String> {
    files(folder).into_iter().filter(|name| !name.starts_with('.')).collect()
}

struct Gif {
    size: [u16; 2],
    pictures: Vec<Picture>,
}

struct Picture {
    /// Its colours at the left edge, at a third of its width and at the right edge.
    colours: [[u8; 3]; 3],
    /// How long it is seen, hundredths of a second.
    delay: u16,
}

fn gif(path: &Path) -> Gif {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(File::open(path).expect("it is there")).expect("a GIF");
    let size = [decoder.width(), decoder.height()];
    let mut pictures = Vec::new();
    while let Some(frame) = decoder.read_next_frame().expect("a whole picture") {
        assert_eq!([frame.width, frame.height], size);
        let at = |x: usize| {
            let i = 4 * (usize::from(size[1]) / 2 * usize::from(size[0]) + x);
            [frame.buffer[i], frame.buffer[i + 1], frame.buffer[i + 2]]
        };
        let width = usize::from(size[0]);
        pictures.push(Picture { colours: [0, width / 3, width - 1].map(at), delay: frame.delay });
    }
    Gif { size, pictures }
}

/// Whether two colours are the same but for what a GIF makes of them.
fn is_like(a: [u8; 3], b: [u8; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.abs_diff(b) < 12)
}

fn png(path: &Path) -> ([u32; 2], Vec<u8>) {
    let decoder = png::Decoder::new(std::io::BufReader::new(File::open(path).expect("it is there")));
    let mut reader = decoder.read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("it fits into memory")];
    let info = reader.next_frame(&mut pixels).expect("a whole picture");
    pixels.truncate(info.buffer_size());
    ([info.width, info.height], pixels)
}

const SIZE: [usize; 2] = [1500, 940];

#[test]
fn ctrl_r_begins_a_film_of_the_scene_and_ends_it_and_it_appears_whole() {
    // Each test has a seed of its own: a folder that one of them removes is not another's.
    let mut window = open(&["homeokinetic", "--seed", "11"]);
    let folder = live(&mut window);
    strike(&mut window, Key::R);
    let first = develop(&window, &screen(SIZE, 0));
    window.step();
    assert!(window.query_by_label_contains("filming").is_some());
    let scene = window.get_by_label("Scene").rect();
    let times = shoot(&mut window, SIZE, 6);
    assert_eq!(shown(&folder), ["run.mcap"]);
    strike(&mut window, Key::R);
    until(&mut window, "it is said where the film is", |window| window.query_by_label_contains("film: ").is_some());
    assert!(window.query_by_label_contains("filming").is_none());

    assert_eq!(files(&folder), ["film-1.gif", "run.mcap"]);
    let film = gif(&folder.join("film-1.gif"));
    let size = [scene.right().round() - scene.left().round(), scene.bottom().round() - scene.top().round()];
    assert_eq!(film.size.map(f32::from), size);
    assert_eq!(film.pictures.len(), first + times.len());
    for (n, Picture { colours: [left, _, right], delay }) in film.pictures[first..].iter().enumerate() {
        let shown = screen(SIZE, n);
        let at = |x: f32| {
            let [r, g, b, _] = shown[(x as usize, 400)].to_array();
            [r, g, b]
        };
        assert!(is_like(*left, at(scene.left() + 1.0)), "picture {n} begins with {left:?}");
        assert!(is_like(*right, at(scene.right() - 2.0)), "picture {n} ends with {right:?}");
        assert!(*delay >= 4, "picture {n} is gone after {delay} hundredths");
    }
    // What was filmed and what is shown take the same time; the last picture is seen for a period.
    let shown = film.pictures[first..].iter().map(|picture| f64::from(picture.delay)).sum::<f64>() / 100.0;
    let [least, most] = [times[5][0] - times[0][1], times[5][1] - times[0][0]].map(|time| time.as_secs_f64() + 0.04);
    assert!((least - 0.02..=most + 0.02).contains(&shown), "{shown} s of {least} to {most} s");
}

#[test]
fn a_film_that_begins_before_the_last_is_written_takes_nothing_from_it() {
    let mut window = open(&["homeokinetic", "--seed", "12"]);
    let folder = live(&mut window);
    for pictures in [8, 2] {
        strike(&mut window, Key::R);
        develop(&window, &screen(SIZE, 0));
        shoot(&mut window, SIZE, pictures - 1);
        strike(&mut window, Key::R);
    }
    until(&mut window, "both are there", |_| shown(&folder).len() == 3);
    assert_eq!(files(&folder), ["film-1.gif", "film-2.gif", "run.mcap"]);
    let pictures = ["film-1.gif", "film-2.gif"].map(|name| gif(&folder.join(name)).pictures.len());
    assert_eq!(pictures, [8, 2]);
}

#[test]
fn a_film_goes_on_when_the_window_changes_its_size() {
    let mut window = open(&["homeokinetic", "--seed", "13"]);
    let folder = live(&mut window);
    strike(&mut window, Key::R);
    develop(&window, &screen(SIZE, 0));
    let scene = window.get_by_label("Scene").rect();
    shoot(&mut window, SIZE, 2);
    for size in [[1200, 800], [1800, 1000]] {
        window.set_size(Vec2::new(size[0] as f32, size[1] as f32));
        shoot(&mut window, size, 2);
    }
    strike(&mut window, Key::R);
    until(&mut window, "the film is there", |_| folder.join("film-1.gif").exists());
    let film = gif(&folder.join("film-1.gif"));
    assert_eq!(f32::from(film.size[0]), scene.right().round() - scene.left().round());
    assert_eq!(film.pictures.len(), 7);
    // In all of them the left half of the screen is in the left of the picture.
    for (n, picture) in [0, 0, 1, 0, 1, 0, 1].into_iter().zip(&film.pictures) {
        let [r, g, b, _] = screen([2, 1], n)[(0, 0)].to_array();
        assert!(is_like(picture.colours[1], [r, g, b]), "{:?} where {n} was filmed", picture.colours);
    }
}

#[test]
fn a_film_whose_folder_is_taken_away_ends_with_a_sentence_and_the_barrel_goes_on() {
    let mut window = open(&["homeokinetic", "--seed", "14"]);
    let folder = live(&mut window);
    strike(&mut window, Key::R);
    develop(&window, &screen(SIZE, 0));
    shoot(&mut window, SIZE, 2);
    std::fs::remove_dir_all(&folder).expect("removed");
    shoot(&mut window, SIZE, 2);
    strike(&mut window, Key::R);
    until(&mut window, "it is said", |window| window.query_by_label_contains("cannot write").is_some());
    assert!(!folder.exists());
    let rows = window.state().history().len();
    until(&mut window, "the barrel goes on", |window| window.state().history().len() > rows);
}

#[test]
fn a_film_without_a_picture_leaves_nothing_and_says_so() {
    let mut window = open(&["homeokinetic", "--seed", "15"]);
    let folder = live(&mut window);
    strike(&mut window, Key::R);
    strike(&mut window, Key::R);
    until(&mut window, "it is said", |window| window.query_by_label_contains("before it had a picture").is_some());
    assert_eq!(files(&folder), ["run.mcap"]);
}

#[test]
fn a_window_that_is_closed_finishes_its_film_first() {
    let mut window = open(&["homeokinetic", "--seed", "16"]);
    let folder = live(&mut window);
    strike(&mut window, Key::R);
    develop(&window, &screen(SIZE, 0));
    shoot(&mut window, SIZE, 3);
    window.state_mut().on_exit(None);
    assert_eq!(files(&folder), ["film-1.gif", "run.mcap"]);
    assert_eq!(gif(&folder.join("film-1.gif")).pictures.len(), 4);
}

#[test]
fn a_film_of_pictures_is_a_folder_of_numbered_pngs() {
    let kept = Kept([("app".to_owned(), "(film:Pictures)".to_owned())].into());
    let size = Vec2::new(SIZE[0] as f32, SIZE[1] as f32);
    let mut window = open_in(&["homeokinetic", "--seed", "17"], Harness::builder().with_size(size), Some(&kept));
    let folder = live(&mut window);
    let scene = window.get_by_label("Scene").rect();
    strike(&mut window, Key::R);
    develop(&window, &screen(SIZE, 0));
    shoot(&mut window, SIZE, 2);
    strike(&mut window, Key::R);
    until(&mut window, "the film is there", |window| window.query_by_label_contains("film: ").is_some());
    let film = folder.join("film-1");
    assert_eq!(files(&film), ["00001.png", "00002.png", "00003.png"]);
    for name in files(&film) {
        let ([width, height], pixels) = png(&film.join(name));
        assert_eq!(width as f32, scene.right().round() - scene.left().round());
        assert_eq!(pixels.len(), 4 * (width * height) as usize);
    }
}

#[test]
fn a_film_whose_pictures_cannot_be_written_ends_by_itself() {
    let kept = Kept([("app".to_owned(), "(film:Pictures)".to_owned())].into());
    let size = Vec2::new(SIZE[0] as f32, SIZE[1] as f32);
    let mut window = open_in(&["homeokinetic", "--seed", "18"], Harness::builder().with_size(size), Some(&kept));
    let folder = live(&mut window);
    strike(&mut window, Key::R);
    develop(&window, &screen(SIZE, 0));
    std::fs::remove_dir_all(folder.join("film-1")).expect("removed");
    until(&mut window, "it ends", |window| {
        develop(window, &screen(SIZE, 1));
        window.query_by_label_contains("cannot write").is_some()
    });
    assert!(window.query_by_label_contains("filming").is_none());
    assert!(!folder.join("film-1").exists());
}

#[test]
fn ctrl_p_writes_what_the_window_shows_and_never_over_another_file() {
    let mut window = open(&["homeokinetic", "--seed", "19"]);
    let folder = live(&mut window);
    std::fs::write(folder.join("view-2.png"), b"somebody's").expect("written");
    for n in 0..3 {
        strike(&mut window, Key::P);
        assert_eq!(develop(&window, &screen(SIZE, n)), 1);
        frames(&mut window, 1);
    }
    until(&mut window, "three pictures", |_| shown(&folder).iter().filter(|name| name.ends_with(".png")).count() == 4);
    assert_eq!(files(&folder), ["run.mcap", "view-1.png", "view-2.png", "view-3.png", "view-4.png"]);
    assert_eq!(std::fs::read(folder.join("view-2.png")).expect("read"), b"somebody's");
    let mut seen: Vec<Vec<u8>> = Vec::new();
    for name in ["view-1.png", "view-3.png", "view-4.png"] {
        let (size, pixels) = png(&folder.join(name));
        assert_eq!(size, [1500, 940]);
        seen.push(pixels);
    }
    // They are written at the same time, so that any of them may have got the first name.
    for n in 0..3 {
        assert!(seen.iter().any(|pixels| pixels[..] == *screen(SIZE, n).as_raw()), "picture {n} is lost");
    }
    until(&mut window, "it is said", |window| window.query_all_by_label_contains("picture: ").count() == 3);
}

#[test]
fn a_picture_that_cannot_be_written_is_answered_with_a_sentence() {
    let mut window = open(&["homeokinetic", "--seed", "20"]);
    let folder = live(&mut window);
    strike(&mut window, Key::P);
    std::fs::remove_dir_all(&folder).expect("removed");
    develop(&window, &screen(SIZE, 0));
    until(&mut window, "it is said", |window| window.query_by_label_contains("cannot write").is_some());
}
