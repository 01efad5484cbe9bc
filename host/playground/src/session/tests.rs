use super::*;

/// A session's end of the desk, and the window's.
fn desk() -> (Port, Session) {
    let (send, orders) = mpsc::channel();
    let desk = Arc::new(Mutex::new(Desk::default()));
    let port = Port { orders, desk: desk.clone(), wake: Box::new(|| {}), fresh: Vec::new(), waiting: Vec::new() };
    (port, Session { orders: Some(send), desk, thread: None, is_robot: false })
}

fn steps(port: &mut Port, steps: std::ops::Range<usize>) {
    for chunk in steps.collect::<Vec<_>>().chunks(400) {
        for &step in chunk {
            port.frame(Frame::at(step as f64 * 0.02));
        }
        port.publish(|_| {});
    }
}

#[test]
fn a_window_that_does_not_look_for_a_while_finds_every_step() {
    let (mut port, session) = desk();
    steps(&mut port, 0..KEPT);
    let frames = session.look().frames;
    assert_eq!(frames.len(), KEPT);
    assert!(frames.windows(2).all(|two| two[0].t < two[1].t));
    assert!(session.look().frames.is_empty(), "nothing is told twice");
}

#[test]
fn a_window_that_does_not_look_for_hours_finds_the_newest_steps_and_costs_no_more_than_that() {
    let (mut port, session) = desk();
    let last = 3 * KEPT;
    steps(&mut port, 0..last);
    let frames = session.look().frames;
    assert!((KEPT..=KEPT + KEPT / 4).contains(&frames.len()), "{} steps", frames.len());
    assert_eq!(frames.last().map(|frame| frame.t), Some((last - 1) as f64 * 0.02));
    assert!(frames.windows(2).all(|two| (two[1].t - two[0].t - 0.02).abs() < 1e-6), "a step is missing");
}

#[test]
fn steps_that_nobody_took_are_not_told_as_the_next_sessions() {
    let (mut port, session) = desk();
    steps(&mut port, 0..1000);
    port.publish(|status| status.session += 1);
    steps(&mut port, 0..10);
    let Desk { frames, status, .. } = session.look();
    assert_eq!((status.session, frames.len()), (1, 10));
    assert_eq!(frames.first().map(|frame| frame.t), Some(0.0));
}

#[test]
fn of_a_knob_that_turns_the_last_word_counts_and_what_came_between_keeps_its_place() {
    use protocol::Id;
    let (mut port, session) = desk();
    let line = |text: &str| Order::Line(text.to_owned());
    let asked = [
        Order::Set(Id::EpsC, 0.1),
        Order::Set(Id::EpsC, 0.2),
        line("pause"),
        Order::Set(Id::EpsC, 0.3),
        Order::Set(Id::EpsA, 0.4),
        Order::Set(Id::EpsA, 0.5),
        line("go"),
    ];
    asked.into_iter().for_each(|order| session.order(order));
    let mut heard = Vec::new();
    while let Asked::Order(order) = port.wait(Duration::ZERO) {
        heard.push(order);
    }
    let expected =
        [Order::Set(Id::EpsC, 0.2), line("pause"), Order::Set(Id::EpsC, 0.3), Order::Set(Id::EpsA, 0.5), line("go")];
    assert_eq!(heard, expected);
    drop(session);
    assert!(matches!(port.wait(Duration::ZERO), Asked::Gone));
}
