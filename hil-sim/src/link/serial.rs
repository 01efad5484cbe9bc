//! A robot on a serial line: a board on USB, or one at the other end of a radio. The same frames as everywhere; this file only
//! carries bytes, and finds words for what can be wrong with a port.

use super::{LinkError, Transport};
use serialport::{ClearBuffer, ErrorKind, SerialPort, SerialPortType};
use std::io::{self, Read, Write};
use std::path::Path;
use std::time::Duration;

/// Bits a second on the virtual COM port of the board's debug probe.
pub const USB_BAUD: u32 = 460_800;
/// Bits a second on the radio.
pub const RADIO_BAUD: u32 = 57_600;

/// How late an answer may be for reasons of its own: USB's time slices, a busy machine.
const LATENCY: Duration = Duration::from_millis(100);
/// Bytes that may be in front of the end of an answer: everything that the robot has on its way out.
const IN_FRONT: u32 = 1024;
/// Bits on the line for a byte: a start bit, eight, a stop bit.
const BITS: u32 = 10;
/// USB vendor of ST, whose debug probes have the virtual COM port.
const ST: u16 = 0x0483;

/// An open serial port, ours alone: 8N1, no flow control. The lines that reset some boards are left as they are.
pub struct Serial {
    port: Box<dyn SerialPort>,
    name: String,
    patience: Duration,
    /// What the slowest answer needs on this line.
    longest: Duration,
}

impl Serial {
    /// Opens the port of this name (`/dev/ttyACM0`, `ttyACM0`, `COM3`) and forgets what has arrived on it so far. The robot's
    /// decoder is put in step.
    ///
    /// # Errors
    /// [`LinkError::Broken`], which says what to do: no such port, not allowed, in use.
    pub fn open(name: &str, baud: u32) -> Result<Self, LinkError> {
        let path = path(name);
        let patience = LATENCY + Duration::from_secs(1) * BITS * IN_FRONT / baud.max(1);
        let port = serialport::new(&path, baud)
            .timeout(patience)
            .open()
            .map_err(|error| LinkError::Broken(not_opened(&path, baud, &error)))?;
        let mut serial = Serial { port, name: path, patience, longest: patience };
        serial.port.clear(ClearBuffer::All).map_err(|error| serial.gone(&error))?;
        serial.write(&[0])?;
        Ok(serial)
    }

    /// The port's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Sets how long an answer may take. At the start it is what the slowest answer needs on this line.
    ///
    /// # Errors
    /// A port that is gone.
    pub fn set_patience(&mut self, patience: Duration) -> Result<(), LinkError> {
        self.patience = patience;
        self.port.set_timeout(patience).map_err(|error| self.gone(&error))
    }

    /// Sets how long an answer may take to what the slowest one needs on this line, as at the start.
    ///
    /// # Errors
    /// A port that is gone.
    pub fn be_patient(&mut self) -> Result<(), LinkError> {
        self.set_patience(self.longest)
    }

    fn gone(&self, error: &dyn std::fmt::Display) -> LinkError {
        LinkError::Broken(format!(
            "the robot's port {} is gone ({error}): was it unplugged, or did the board lose its power?",
            self.name
        ))
    }
}

impl Transport for Serial {
    fn write(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.port.write_all(bytes).map_err(|error| match error.kind() {
            io::ErrorKind::TimedOut => LinkError::Broken(format!(
                "the port {} takes nothing that is written to it: what is on it has stopped; unplug it and plug it in again",
                self.name
            )),
            _ => self.gone(&error),
        })
    }

    fn read(&mut self, buffer: &mut Vec<u8>) -> Result<(), LinkError> {
        let mut arrived = [0; 4096];
        loop {
            match self.port.read(&mut arrived) {
                Ok(0) => return Err(self.gone(&"end of file")),
                Ok(count) => {
                    buffer.extend_from_slice(&arrived[..count]);
                    return Ok(());
                }
                Err(error) if error.kind() == io::ErrorKind::TimedOut => return Err(LinkError::NoAnswer),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(self.gone(&error)),
            }
        }
    }

    fn patience(&self) -> Option<Duration> {
        Some(self.patience)
    }
}

impl std::fmt::Debug for Serial {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Serial").field("name", &self.name).field("patience", &self.patience).finish_non_exhaustive()
    }
}

/// A serial port of this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// What it is opened by.
    pub name: String,
    /// What it belongs to.
    pub kind: PortKind,
}

/// What a serial port belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PortKind {
    /// A debug probe of ST, as on the robot's board.
    DebugProbe,
    /// Another device on USB: a radio, or something else altogether.
    Usb,
    /// The machine's own, or of a kind that is not known.
    Other,
}

/// The serial ports of this machine: debug probes, then other devices on USB, then the rest, each by name.
pub fn ports() -> Vec<Port> {
    // A machine without a single terminal device has no such folder, and the crate expects one.
    if cfg!(target_os = "linux") && !Path::new("/sys/class/tty").is_dir() {
        return Vec::new();
    }
    // A system that cannot say which ports there are has none to offer.
    let found = serialport::available_ports().unwrap_or_default();
    let mut ports: Vec<Port> = found
        .into_iter()
        .map(|port| {
            let kind = match port.port_type {
                SerialPortType::UsbPort(usb) if usb.vid == ST => PortKind::DebugProbe,
                SerialPortType::UsbPort(_) => PortKind::Usb,
                _ => PortKind::Other,
            };
            Port { name: port.port_name, kind }
        })
        .collect();
    ports.sort_by(|a, b| (a.kind, &a.name).cmp(&(b.kind, &b.name)));
    ports
}

/// The ports that a robot can be on, in words.
pub fn ports_in_words() -> String {
    let names: Vec<String> = ports().into_iter().filter(|p| p.kind != PortKind::Other).map(|p| p.name).collect();
    match names.as_slice() {
        [] => "there is none on USB: plug the board in".to_owned(),
        names => format!("on USB there are: {}", names.join(", ")),
    }
}

/// The device of a port that may have been given by its bare name.
fn path(name: &str) -> String {
    if cfg!(unix) && !name.contains('/') { format!("/dev/{name}") } else { name.to_owned() }
}

fn not_opened(path: &str, baud: u32, error: &serialport::Error) -> String {
    match error.kind {
        ErrorKind::Io(io::ErrorKind::NotFound) => format!("there is no serial port {path}; {}", ports_in_words()),
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => format!(
            "this user may not open {path}: join the group that owns it (on Debian and Ubuntu: \
             `sudo usermod -aG dialout $USER`, then log in again), or install the udev rule of docs/flashing.md"
        ),
        // What is not there at all has been told apart: this one is locked.
        ErrorKind::NoDevice if !cfg!(unix) || Path::new(path).exists() => format!(
            "{path} is in use: end the program that has it open (another `barrel`, a serial terminal, ModemManager)"
        ),
        _ => format!(
            "{path} cannot be used as a serial port at {baud} baud: {}; {}",
            error.description,
            ports_in_words()
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_with_a_port_comes_with_what_to_do() {
        let said = |kind, path: &str| not_opened(path, 57_600, &serialport::Error::new(kind, "as the system puts it"));
        let missing = said(ErrorKind::Io(io::ErrorKind::NotFound), "/dev/ttyACM7");
        assert!(missing.contains("no serial port /dev/ttyACM7") && missing.contains("USB"), "{missing}");
        let forbidden = said(ErrorKind::Io(io::ErrorKind::PermissionDenied), "/dev/ttyACM0");
        assert!(forbidden.contains("dialout") && forbidden.contains("udev"), "{forbidden}");
        // Something that is there for certain stands for a port that is locked.
        assert!(said(ErrorKind::NoDevice, "/").contains("in use"));
        let other = said(ErrorKind::Unknown, "/dev/ttyACM0");
        assert!(other.contains("57600 baud: as the system puts it"), "{other}");
    }

    #[cfg(unix)]
    #[test]
    fn a_bare_name_is_a_device() {
        assert_eq!(path("ttyACM0"), "/dev/ttyACM0");
        assert_eq!(path("./robot"), "./robot");
    }
}
