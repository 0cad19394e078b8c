//! Who may do what: access tokens, takeover tokens; and what the server says about itself.
#![allow(clippy::unwrap_used, clippy::panic)]

mod support;

use std::time::{SystemTime, UNIX_EPOCH};

use hmac::{Hmac, Mac};
use jwt::SignWithKey;
use mis_slam::http::access::Claims;
use protocol::routes;
use protocol::v1::{Reason, from_server, to_server};
use serde_json::json;
use support::{SIZE_PX, TestServer, calibration, wire_pair};
use tempfile::TempDir;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;

const SECRET: &str = "a secret of more than thirty-two bytes";

fn seconds_from_now(seconds: i64) -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs();
    now.saturating_add_signed(seconds)
}

fn signed(secret: &str, scope: &str, session: Option<&str>, valid_s: i64) -> String {
    let claims = Claims {
        sub: "test".into(),
        exp: seconds_from_now(valid_s),
        jti: format!("{scope}-{}", session.unwrap_or("all")),
        scope: scope.into(),
        session: session.map(str::to_owned),
    };
    let key: Hmac<sha2::Sha256> = Hmac::new_from_slice(secret.as_bytes()).unwrap();
    claims.sign_with_key(&key).unwrap()
}

fn token(scope: &str, session: Option<&str>) -> String {
    signed(SECRET, scope, session, 600)
}

/// A server that wants tokens, and the file of those that were revoked.
async fn guarded(folder: &TempDir) -> TestServer {
    let (key_file, revoked_file) = (folder.path().join("key"), folder.path().join("revoked"));
    std::fs::write(&key_file, format!("{SECRET}\n")).unwrap();
    std::fs::write(&revoked_file, "").unwrap();
    TestServer::start_with(|config| {
        config.access.required = true;
        config.access.key_file = key_file;
        config.access.revoked_file = revoked_file;
    })
    .await
}

#[tokio::test]
async fn without_a_valid_token_nothing_is_told_and_health_is() {
    let folder = TempDir::new().unwrap();
    let server = guarded(&folder).await;
    let forged = signed("another secret of more than thirty-two bytes", "manage", None, 600);
    let expired = signed(SECRET, "manage", None, -1);
    for token in [None, Some("nonsense"), Some(&forged), Some(&expired)] {
        for path in ["/api/sessions", "/api/finished", "/api/recordings", "/metrics"] {
            let (status, answer) = server.request_as(token, "GET", path, None).await;
            assert_eq!(
                (status, answer["reason"].as_str()),
                (401, Some("unauthenticated")),
                "{path} {token:?}"
            );
        }
    }
    assert_eq!(server.request("GET", "/api/health", None).await.0, 200);
}

#[tokio::test]
async fn a_token_does_what_its_scope_says() {
    let folder = TempDir::new().unwrap();
    let server = guarded(&folder).await;
    let (view, feed) = (token("view", None), token("feed", None));
    let body = json!({"session": "a", "calibration": calibration(SIZE_PX)});
    let (status, answer) = server.request_as(Some(&view), "POST", "/api/sessions", Some(body.clone())).await;
    assert_eq!((status, answer["reason"].as_str()), (403, Some("forbidden")));
    assert_eq!(server.request_as(Some(&feed), "POST", "/api/sessions", Some(body)).await.0, 201);
    assert_eq!(server.request_as(Some(&view), "GET", "/api/sessions/a", None).await.0, 200);
    assert_eq!(server.request_as(Some(&view), "DELETE", "/api/sessions/a", None).await.0, 403);
    let upload = server.request_as(Some(&feed), "PUT", "/api/recordings/x.mcap", None).await;
    assert_eq!(upload.0, 403, "{upload:?}");
}

#[tokio::test]
async fn a_session_that_a_token_does_not_cover_looks_like_none() {
    let folder = TempDir::new().unwrap();
    let server = guarded(&folder).await;
    let (feed, only_a) = (token("feed", None), token("manage", Some("a")));
    for id in ["a", "b"] {
        let body = json!({"session": id, "calibration": calibration(SIZE_PX)});
        assert_eq!(server.request_as(Some(&feed), "POST", "/api/sessions", Some(body)).await.0, 201);
    }
    let foreign = server.request_as(Some(&only_a), "GET", "/api/sessions/b", None).await;
    let unknown = server.request_as(Some(&only_a), "GET", "/api/sessions/c", None).await;
    assert_eq!((foreign.0, unknown.0), (404, 404));
    assert_eq!(foreign.1.to_string().replace("session b", "session c"), unknown.1.to_string());
    let (_, list) = server.request_as(Some(&only_a), "GET", "/api/sessions", None).await;
    assert_eq!((list.as_array().map(Vec::len), list[0]["session"].as_str()), (Some(1), Some("a")));
    for route in ["ingest", "view"] {
        let path = format!("/api/sessions/b/{route}?access_token={only_a}");
        assert_eq!(server.refused_upgrade(&path).await, 404);
    }
}

#[tokio::test]
async fn an_open_stream_is_closed_when_its_token_is_revoked_or_expires() {
    let folder = TempDir::new().unwrap();
    let server = guarded(&folder).await;
    let body = json!({"session": "a", "calibration": calibration(SIZE_PX)});
    server.request_as(Some(&token("feed", None)), "POST", "/api/sessions", Some(body)).await;
    let mut viewer = server.join(&format!("/api/sessions/a/view?access_token={}", token("view", None))).await;
    let short = signed(SECRET, "feed", Some("a"), 2);
    let mut cart = server.join(&format!("/api/sessions/a/ingest?access_token={short}")).await;
    std::fs::write(folder.path().join("revoked"), "view-all\n").unwrap();
    for client in [&mut viewer, &mut cart] {
        let (last_words, code) = client.hear_close().await;
        assert_eq!(code, 1008);
        let Some(from_server::Body::Refusal(refusal)) = last_words else { panic!("{last_words:?}") };
        assert_eq!(refusal.reason(), Reason::Unauthenticated, "{refusal:?}");
    }
    let (status, answer) = server.request_as(Some(&token("view", None)), "GET", "/api/sessions", None).await;
    assert_eq!((status, answer["text"].as_str()), (401, Some("the token was revoked")));
}

#[tokio::test]
async fn tokens_that_protect_nothing_keep_the_server_from_starting() {
    let folder = TempDir::new().unwrap();
    let key_file = folder.path().join("key");
    let refused = async |key: Option<&str>, zenoh: bool| {
        if let Some(key) = key {
            std::fs::write(&key_file, key).unwrap();
        }
        let problem = TestServer::refused_with(|config| {
            config.access.required = true;
            config.access.key_file.clone_from(&key_file);
            config.zenoh.enabled = zenoh;
        });
        problem.await.to_string()
    };
    assert!(refused(None, false).await.contains("key_file"));
    assert!(refused(Some("short"), false).await.contains("32"));
    assert!(refused(Some(SECRET), true).await.contains("zenoh.enabled"));
}

#[tokio::test]
async fn a_second_cart_needs_the_takeover_token_and_the_first_is_told() {
    let server = TestServer::start().await;
    let body = json!({"session": "a", "calibration": calibration(SIZE_PX)});
    let (_, opened) = server.request("POST", "/api/sessions", Some(body)).await;
    let token = opened["takeover_token"].as_str().unwrap().to_owned();
    let mut first = server.connect("/api/sessions/a/ingest").await;
    first.say(to_server::Body::Hello(protocol::hello("first"))).await;
    let from_server::Body::Hello(hello) = first.hear().await else { panic!("a hello") };
    assert_eq!(hello.takeover_token, token);

    let presenting = |presented: &str| {
        let url = format!("ws://{}/api/sessions/a/ingest", server.address);
        let mut request = url.into_client_request().unwrap();
        request.headers_mut().insert(routes::TAKEOVER_HEADER, presented.parse().unwrap());
        request
    };
    assert_eq!(server.refused_upgrade("/api/sessions/a/ingest").await, 409);
    assert_eq!(support::refusal_status(presenting("guessed")).await, 409);
    let (socket, _) = tokio_tungstenite::connect_async(presenting(&token)).await.unwrap();
    let mut second = support::Client { socket };
    second.say(to_server::Body::Hello(protocol::hello("second"))).await;

    let (last_words, code) = first.hear_close().await;
    assert_eq!(code, 1008);
    let Some(from_server::Body::Refusal(refusal)) = last_words else { panic!("{last_words:?}") };
    assert_eq!(refusal.reason(), Reason::TakenOver);
    second.say(to_server::Body::Pair(wire_pair(1))).await;
    assert_eq!(second.hear_until(support::pose).await.sequence, 1);
    let (_, seen) = server.request("GET", "/api/sessions/a", None).await;
    assert!(seen.get("takeover_token").is_none(), "{seen}");
}

#[tokio::test]
async fn the_document_of_the_api_names_every_route() {
    let server = TestServer::start().await;
    let (status, document) = server.request("GET", "/openapi.json", None).await;
    assert_eq!((status, document["info"]["title"].as_str()), (200, Some("MIS-SLAM server")));
    for route in routes::ALL {
        assert!(document["paths"].get(route).is_some(), "{route} is not documented");
    }
    let open = &document["paths"][routes::SESSIONS]["post"];
    assert!(open["responses"].get("429").is_some() && open["requestBody"].is_object(), "{open:#}");
    assert!(document["components"]["schemas"]["Calibration"].is_object());
}

#[tokio::test]
async fn counts_are_scraped_by_session_and_reason() {
    let server = TestServer::start().await;
    server.open("a").await;
    let mut cart = server.join("/api/sessions/a/ingest").await;
    for sequence in [1, 1] {
        cart.say(to_server::Body::Pair(wire_pair(sequence))).await;
    }
    server.state_when("a", |state| state["pairs_received"] == 2 && state["surfels"] == 1).await;
    let (status, text) = server.download("/metrics").await;
    let text = String::from_utf8(text).unwrap();
    assert_eq!(status, 200);
    for line in [
        "mis_slam_sessions 1",
        "mis_slam_pairs_received_total{session=\"a\"} 2.0",
        "mis_slam_drops_total{session=\"a\",reason=\"duplicate_stamp\"} 1",
        "mis_slam_surfels{session=\"a\"} 1.0",
    ] {
        assert!(text.lines().any(|found| found == line), "{line} is not in\n{text}");
    }
    assert!(text.contains("mis_slam_model_age_seconds"), "{text}");
}
