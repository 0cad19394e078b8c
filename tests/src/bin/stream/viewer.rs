//! A viewer on a WebSocket: what it was sent, when, and what it made of it.

use std::net::SocketAddr;
use std::time::Instant;

use dense::Surfel;
use futures_util::{SinkExt, StreamExt};
use protocol::v1::{from_server, to_server};
use replica::{Progress, Replica};
use tokio::net::{TcpSocket, TcpStream};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{WebSocketStream, client_async};

use crate::error::StreamError;
use crate::selection::Run;
use crate::server::SESSION;

/// Small, so that what is on its way waits in the server's account and not in a buffer that nobody sees.
const RECEIVE_BUFFER_BYTES: u32 = 64 << 10;

/// A connected viewer.
pub struct Viewer {
    socket: WebSocketStream<TcpStream>,
    /// Its model; one without only counts.
    pub replica: Option<Replica>,
    pub bytes: usize,
    /// Arrival of each epoch, and of each pose by its sequence number.
    pub epochs: Vec<(u32, Instant)>,
    pub poses: Vec<(u64, Instant)>,
    /// Snapshots that were completed.
    pub seeds: usize,
}

/// What came in one message.
pub enum Heard {
    /// Something else.
    Nothing,
    /// A part of a snapshot.
    Chunk,
    /// The model stands at this epoch.
    Epoch(u32),
}

impl Viewer {
    /// Joins the session.
    pub async fn join(address: SocketAddr, replica: Option<Replica>) -> Result<Self, StreamError> {
        let tcp = TcpSocket::new_v4()?;
        tcp.set_recv_buffer_size(RECEIVE_BUFFER_BYTES)?;
        let tcp = tcp.connect(address).await?;
        tcp.set_nodelay(true)?;
        let url = format!("ws://{address}/api/sessions/{SESSION}/view");
        let (socket, _) = client_async(url, tcp).await.map_err(Box::new)?;
        let mut viewer = Self { socket, replica, bytes: 0, epochs: Vec::new(), poses: Vec::new(), seeds: 0 };
        let hello = protocol::to_server(to_server::Body::Hello(protocol::hello("bench")), None);
        viewer.socket.send(Message::Binary(hello)).await.map_err(Box::new)?;
        Ok(viewer)
    }

    /// Takes the next message in.
    pub async fn hear(&mut self) -> Result<Heard, StreamError> {
        let message = self.socket.next().await.ok_or(StreamError::Closed)?.map_err(Box::new)?;
        let now = Instant::now();
        let Message::Binary(bytes) = message else { return Ok(Heard::Nothing) };
        let length = bytes.len();
        match protocol::decode_from_server(bytes)?.body {
            Some(from_server::Body::Pose(pose)) => {
                self.poses.push((pose.sequence, now));
                Ok(Heard::Nothing)
            }
            Some(from_server::Body::Snapshot(chunk)) => {
                self.bytes += length;
                let progress = self.replica.as_mut().map(|replica| replica.take_chunk(&chunk)).transpose()?;
                self.seeds += usize::from(progress == Some(Progress::Current));
                Ok(if progress == Some(Progress::Current) { Heard::Epoch(chunk.epoch) } else { Heard::Chunk })
            }
            Some(from_server::Body::Epoch(epoch)) => {
                self.bytes += length;
                self.epochs.push((epoch.epoch, now));
                self.replica.as_mut().map(|replica| replica.take_epoch(&epoch)).transpose()?;
                Ok(Heard::Epoch(epoch.epoch))
            }
            _ => Ok(Heard::Nothing),
        }
    }

    /// Distances of all surfels held from the model's own, millimetres, where the frame's truth was kept.
    pub fn errors_mm(&self, run: &Run) -> Option<Vec<f64>> {
        let replica = self.replica.as_ref().filter(|replica| replica.is_current())?;
        let frame = run.frames.get((replica.epoch() as usize).checked_sub(1)?)?;
        let truth = &frame.kept.as_ref()?.truth;
        let table = replica.surfels();
        let error =
            |(&id, row): (&u32, &replica::Surfel)| distance_mm(&truth[id as usize], row.position_in_world_m);
        Some(table.ids().iter().zip(table.rows()).map(error).collect())
    }
}

fn distance_mm(truth: &Surfel, position: [f32; 3]) -> f64 {
    let squared: f64 = truth.position.iter().zip(position).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    squared.sqrt() * 1e3
}
