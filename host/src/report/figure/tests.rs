use super::*;

fn wave(step: f64, count: u32) -> Vec<[f64; 2]> {
    (0..count).map(|i| f64::from(i) * step).map(|t| [t, t.sin()]).collect()
}

fn panel(title: &str) -> Panel {
    Panel::new(title, Axis::linear("t (s)"), Axis::linear("x"))
}

/// One figure with every kind of layer.
fn everything() -> Figure {
    let cell = Cell { x: [0.0, 1.0], y: [-1.0, 1.0], value: f64::NAN, text: "a\nb".into() };
    let panel = panel("all of it")
        .spans("rest", vec![[1.0, 2.0], [5.0, f64::INFINITY]])
        .cells(vec![cell], 0.0, 1.0)
        .bars("counts", Ink::Green, vec![[2.0, 3.0, 0.5], [3.0, f64::NAN, 1.0]])
        .line("x1", Ink::Blue, wave(0.1, 80))
        .dashed("x2", Ink::Vermillion, vec![[0.0, 0.0], [1.0, f64::NAN], [2.0, f64::NEG_INFINITY], [3.0, 1.0]])
        .marks("kick", vec![4.0, f64::NAN])
        .levels("limit", vec![0.9]);
    let panel = Marker::ALL
        .into_iter()
        .fold(panel, |panel, marker| panel.points(format!("{marker:?}"), Ink::Purple, marker, wave(0.7, 9)));
    Figure::one(panel, 200.0)
}

fn svg(figure: &Figure) -> String {
    figure.svg().expect("the figure is sound")
}

/// Every number in an attribute of this name.
fn attributes<'a>(svg: &'a str, name: &str) -> Vec<&'a str> {
    let start = format!(" {name}=\"");
    svg.split(&start).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn a_figure_is_one_balanced_element_with_a_view_box_and_finite_numbers() {
    let svg = svg(&everything());
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n") && svg.contains("viewBox=\"0 0 1920 "), "{svg}");
    let mut open = Vec::new();
    for tag in svg.split('<').skip(1).filter_map(|tag| tag.split('>').next()) {
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "closed too early");
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().expect("a name"));
        }
    }
    assert!(open.is_empty(), "{open:?} are left open");
    assert!(!svg.contains("NaN") && !svg.contains("\"inf") && !svg.contains("\"-inf"), "{svg}");
}

#[test]
fn the_same_figure_gives_the_same_bytes() {
    assert_eq!(svg(&everything()), svg(&everything()));
}

#[test]
fn text_is_escaped_everywhere() {
    let cell = Cell { x: [0.0, 1.0], y: [0.0, 1.0], value: 1.0, text: "<e&".into() };
    let axes = (Axis::linear("<a&").ticks([(0.5, "<b&")]), Axis::linear("<c&"));
    let panel = Panel::new("<d&", axes.0, axes.1).cells(vec![cell], 0.0, 1.0).line("<f&", Ink::Sky, wave(0.1, 5));
    let svg = svg(&Figure::one(panel, 200.0));
    for letter in 'a'..='f' {
        assert!(svg.contains(&format!("&lt;{letter}&amp;")), "{letter} is missing");
        assert!(!svg.contains(&format!("<{letter}&")), "{letter} is raw");
    }
}

#[test]
fn a_long_line_is_short_and_keeps_its_extremes() {
    let mut points: Vec<[f64; 2]> = (0..100_000).map(|i| [f64::from(i), 0.0]).collect();
    (points[12_345][1], points[67_890][1]) = (7.0, -3.0);
    let axes = || (Axis::linear("").within(0.0, 1e5), Axis::linear("").within(-3.0, 7.0));
    let (x, y) = axes();
    let svg = svg(&Figure::one(Panel::new("", x, y).line("", Ink::Blue, points), 100.0));
    let path = attributes(&svg, "points").into_iter().max_by_key(|path| path.len()).expect("a line");
    assert!(path.split(' ').count() < 4 * 960, "{} points", path.split(' ').count());
    let heights = path.split_whitespace().map(|point| point.split(',').nth(1).expect("x,y").parse::<i32>().expect("y"));
    let heights: Vec<i32> = heights.collect();
    // The frame is 100 pixels high, 200 of the backend's.
    assert_eq!(heights.iter().max().expect("points") - heights.iter().min().expect("points"), 200);
}

#[test]
fn zero_and_less_are_gaps_on_a_logarithmic_axis() {
    let lines = |values: [f64; 4]| {
        let points = values.into_iter().zip(1_u32..).map(|(y, x)| [f64::from(x), y]).collect();
        let panel = Panel::new("", Axis::linear("x"), Axis::log("E").within(0.1, 10.0)).line("", Ink::Orange, points);
        svg(&Figure::one(panel, 100.0)).matches("#E69F00").count()
    };
    assert_eq!(lines([1.0, 2.0, 3.0, 4.0]), 1);
    assert_eq!(lines([1.0, 0.0, 3.0, 4.0]), 2);
    assert_eq!(lines([1.0, -1.0, 0.0, 4.0]), 2);
    assert_eq!(lines([0.0, -1.0, f64::NAN, 0.0]), 0);
}

#[test]
fn what_lies_beyond_the_range_is_cut_at_the_frame() {
    let x = Axis::linear("").within(0.0, 1.0).ticks([(7.0, "")]);
    let y = Axis::linear("").within(0.0, 1.0).ticks([(7.0, "")]);
    let beyond = vec![[-1.0, 0.5], [0.5, 0.5], [0.5, 1e9], [0.7, 1e9], [0.7, 0.5], [1e9, 0.5]];
    let panel = Panel::new("", x, y).line("", Ink::Blue, beyond.clone()).points("", Ink::Sky, Marker::Disc, beyond);
    let svg = svg(&Figure::one(panel, 100.0));
    let lines: Vec<&str> = svg.lines().filter(|line| line.contains("polyline") && line.contains("#0072B2")).collect();
    assert_eq!(lines.len(), 2, "the line leaves and comes back: {lines:?}");
    for point in lines.iter().flat_map(|line| attributes(line, "points")).flat_map(str::split_whitespace) {
        let (x, y) = point.split_once(',').expect("x,y");
        let (x, y): (i32, i32) = (x.parse().expect("x"), y.parse().expect("y"));
        assert!((48..=1872).contains(&x) && (8..=208).contains(&y), "{point}");
    }
    assert_eq!(svg.matches("<circle").count(), 2, "points beyond are not drawn");
}

#[test]
fn each_class_has_one_marker_in_the_panel_and_in_the_legend() {
    let shapes = Marker::ALL.map(|marker| {
        let panel = panel("").points("class", Ink::Green, marker, vec![[0.0, 0.0], [1.0, 1.0]]);
        let svg = svg(&Figure::one(panel, 100.0));
        let drawn: Vec<(String, bool)> = svg
            .lines()
            .filter(|line| line.contains("#009E73"))
            .map(|line| (line.split(' ').next().expect("a name").to_string(), line.contains("fill=\"none\"")))
            .collect();
        let count = if marker == Marker::Cross { 2 } else { 1 };
        assert_eq!(drawn.len(), 3 * count, "{marker:?}: two points and one sample, {drawn:?}");
        assert!(drawn.iter().all(|shape| shape == &drawn[0]), "{marker:?}: {drawn:?}");
        let corners = attributes(&svg, "points").iter().filter(|path| path.split_whitespace().count() == 3).count();
        (drawn[0].clone(), corners)
    });
    for (i, shape) in shapes.iter().enumerate() {
        assert!(!shapes[..i].contains(shape), "two markers look like {shape:?}");
    }
}

#[test]
fn a_label_is_in_the_legend_once() {
    let panel = panel("").line("run", Ink::Blue, wave(0.1, 9)).line("run", Ink::Blue, wave(0.2, 9));
    let svg = svg(&Figure::one(panel.line("", Ink::Sky, wave(0.3, 9)), 100.0));
    assert_eq!(svg.matches("\nrun\n").count(), 1);
    assert_eq!(svg.matches("#0072B2").count(), 3, "two lines, one sample");
}

#[test]
fn a_panel_without_data_says_so() {
    for (data, said) in [(vec![], 1), (vec![[f64::NAN, 1.0]], 1), (vec![[0.0, 1.0]], 0)] {
        let svg = svg(&Figure::one(panel("").line("x1", Ink::Blue, data), 100.0));
        assert_eq!(svg.matches("no data").count(), said);
    }
}

#[test]
fn stacked_panels_share_one_axis_that_is_labelled_once() {
    let panels = vec![panel("a").line("", Ink::Blue, wave(0.1, 99)), panel("b").line("", Ink::Blue, wave(0.1, 50))];
    let svg = svg(&Figure::stacked(panels, 100.0));
    assert_eq!((svg.matches("\nt (s)\n").count(), svg.matches("\n5\n").count()), (1, 1));
}

#[test]
fn figures_that_cannot_be_drawn_are_refused() {
    assert_eq!(Figure::default().svg(), Err(FigureError::Empty));
    assert_eq!(Figure { rows: vec![Row { height: 100.0, panels: vec![] }] }.svg(), Err(FigureError::Empty));
    let small = Figure { rows: vec![Row { height: 100.0, panels: vec![panel(""); 40] }] };
    assert!(matches!(small.svg(), Err(FigureError::Small { row: 1, .. })));
    assert!(matches!(Figure::one(panel(""), f64::NAN).svg(), Err(FigureError::Small { .. })));
    for (axis, low, high) in
        [(Axis::linear("x"), 1.0, 1.0), (Axis::linear("x"), 0.0, f64::NAN), (Axis::log("x"), 0.0, 1.0)]
    {
        let figure = Figure::one(Panel::new("", axis.within(low, high), Axis::linear("y")), 100.0);
        assert!(matches!(figure.svg(), Err(FigureError::Range { .. })), "{low} to {high}");
    }
}
