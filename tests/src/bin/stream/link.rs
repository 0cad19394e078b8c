//! A network worse than loopback, in user space: a proxy with a rate, a delay and lost segments.
//!
//! TCP hides a lost segment as a pause of about one round trip, in which nothing behind it is delivered; so does this.

use std::net::SocketAddr;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::sync::mpsc;
use tokio::time::Instant;

use crate::error::StreamError;

const SEGMENT_BYTES: usize = 1448;
/// Both sockets of the proxy: what waits, waits at the server.
const BUFFER_BYTES: u32 = 32 << 10;

/// The way from server to viewer.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    pub bits_per_s: f64,
    pub delay: Duration,
    pub loss: f64,
}

impl Link {
    /// Listens for one viewer and connects it to `server`.
    pub async fn open(self, server: SocketAddr) -> Result<SocketAddr, StreamError> {
        let listener = TcpListener::bind(("127.0.0.1", 0)).await?;
        let address = listener.local_addr()?;
        tokio::spawn(async move {
            let Ok((viewer, _)) = listener.accept().await else { return };
            // The end of either connection ends both; that is how a viewer leaves.
            let _ = self.carry(viewer, server).await;
        });
        Ok(address)
    }

    async fn carry(self, viewer: TcpStream, server: SocketAddr) -> Result<(), StreamError> {
        let socket = TcpSocket::new_v4()?;
        socket.set_recv_buffer_size(BUFFER_BYTES)?;
        let (from_server, mut to_server) = socket.connect(server).await?.into_split();
        viewer.set_nodelay(true)?;
        let (mut from_viewer, to_viewer) = viewer.into_split();
        let upstream = async move { tokio::io::copy(&mut from_viewer, &mut to_server).await.map(drop) };
        // As many segments as are on their way at the full rate, and a router's queue of a tenth of a second.
        let seconds = self.delay.as_secs_f64() + 0.1;
        let on_the_way = (self.bits_per_s / 8.0 * seconds) as usize / SEGMENT_BYTES + 1;
        let (segments, arriving) = mpsc::channel(on_the_way);
        let sending = self.send(from_server, segments);
        let delivering = deliver(arriving, to_viewer);
        tokio::select! {
            ended = upstream => Ok(ended?),
            ended = sending => ended,
            ended = delivering => ended,
        }
    }

    async fn send(
        self,
        mut from_server: tokio::net::tcp::OwnedReadHalf,
        segments: mpsc::Sender<(Instant, Vec<u8>)>,
    ) -> Result<(), StreamError> {
        let mut free_at = Instant::now();
        let mut number = 0_u32;
        loop {
            let mut segment = vec![0; SEGMENT_BYTES];
            let length = from_server.read(&mut segment).await?;
            if length == 0 {
                return Ok(());
            }
            segment.truncate(length);
            let takes = Duration::from_secs_f64(length as f64 * 8.0 / self.bits_per_s);
            free_at = free_at.max(Instant::now()) + takes;
            tokio::time::sleep_until(free_at).await;
            number += 1;
            let chance = f64::from(protocol::surfel_digest(number, 1)) / f64::from(u32::MAX);
            let repeated = if chance < self.loss { 2 * self.delay } else { Duration::ZERO };
            if segments.send((free_at + self.delay + repeated, segment)).await.is_err() {
                return Ok(());
            }
        }
    }
}

async fn deliver(
    mut arriving: mpsc::Receiver<(Instant, Vec<u8>)>,
    mut to_viewer: tokio::net::tcp::OwnedWriteHalf,
) -> Result<(), StreamError> {
    while let Some((due, segment)) = arriving.recv().await {
        tokio::time::sleep_until(due).await;
        to_viewer.write_all(&segment).await?;
    }
    Ok(())
}
