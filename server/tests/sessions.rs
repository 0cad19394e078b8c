//! Opening, listing and closing sessions over HTTP.

mod support;

use serde_json::json;
use support::{SIZE_PX, TestServer, calibration};

#[tokio::test]
async fn a_session_is_opened_listed_inspected_and_closed() {
    let server = TestServer::start().await;
    let body = json!({"calibration": calibration(SIZE_PX)});
    let (status, opened) = server.request("POST", "/api/sessions", Some(body)).await;
    assert_eq!((status, opened["status"].as_str()), (201, Some("waiting")));
    let id = opened["session"].as_str().unwrap();
    assert!(id.len() >= 16, "{id} can be guessed");
    let (_, list) = server.request("GET", "/api/sessions", None).await;
    assert_eq!(list[0]["session"], id);
    let path = format!("/api/sessions/{id}");
    assert_eq!(server.request("GET", &path, None).await.0, 200);
    assert_eq!(server.request("DELETE", &path, None).await.0, 204);
    assert_eq!(server.request("GET", &path, None).await.0, 404);
    assert_eq!(server.request("DELETE", &path, None).await.0, 404);
}

#[tokio::test]
async fn calibrations_that_no_endoscope_has_are_refused_by_field() {
    let server = TestServer::start().await;
    let refused = async |change: fn(&mut protocol::v1::RectifiedRig)| {
        let mut broken = calibration(SIZE_PX);
        change(broken.rectified.as_mut().unwrap());
        let body = json!({"calibration": broken});
        let (status, body) = server.request("POST", "/api/sessions", Some(body)).await;
        assert_eq!((status, body["reason"].as_str()), (422, Some("invalid_calibration")), "{body}");
        body["text"].as_str().unwrap().to_owned()
    };
    let left = |rig: &mut protocol::v1::RectifiedRig| rig.left.as_mut().unwrap().fx_px = 0.0;
    assert!(refused(left).await.contains("left.fx_px"));
    assert!(refused(|rig| rig.left = None).await.contains("rectified.left"));
    assert!(refused(|rig| rig.baseline_m = 0.05).await.contains("50"));
    assert!(refused(|rig| rig.baseline_m = -0.005).await.contains("swapped"));
    assert!(refused(|rig| rig.left.as_mut().unwrap().width_px = 1 << 20).await.contains("left.width_px"));
    let neither = json!({"calibration": {}});
    assert_eq!(server.request("POST", "/api/sessions", Some(neither)).await.0, 422);
}

#[tokio::test]
async fn requests_that_make_no_sense_are_refused() {
    let server = TestServer::start().await;
    for body in [json!({}), json!([1]), json!({"calibration": calibration(SIZE_PX), "colour": "red"})] {
        let (status, answer) = server.request("POST", "/api/sessions", Some(body)).await;
        assert_eq!((status, answer["reason"].as_str()), (400, Some("malformed_message")));
    }
    let bad_id = json!({"session": "../etc", "calibration": calibration(SIZE_PX)});
    assert_eq!(server.request("POST", "/api/sessions", Some(bad_id)).await.0, 400);
    let huge = json!({"session": "x".repeat(70_000), "calibration": calibration(SIZE_PX)});
    assert_eq!(server.request("POST", "/api/sessions", Some(huge)).await.0, 413);
}

#[tokio::test]
async fn a_name_is_taken_once_and_room_is_limited() {
    let server = TestServer::start_with(|config| config.session.sessions_max = 2).await;
    server.open("a").await;
    let again = json!({"session": "a", "calibration": calibration(SIZE_PX)});
    assert_eq!(server.request("POST", "/api/sessions", Some(again)).await.0, 409);
    server.open("b").await;
    let third = json!({"calibration": calibration(SIZE_PX)});
    assert_eq!(server.request("POST", "/api/sessions", Some(third.clone())).await.0, 429);
    server.request("DELETE", "/api/sessions/a", None).await;
    assert_eq!(server.request("POST", "/api/sessions", Some(third)).await.0, 201);
}

#[tokio::test]
async fn a_session_that_no_cart_feeds_is_closed_after_its_time_to_live() {
    let server = TestServer::start_with(|config| config.session.ttl_s = 0.3).await;
    server.open("a").await;
    support::within(async {
        while server.request("GET", "/api/sessions/a", None).await.0 != 404 {
            tokio::time::sleep(std::time::Duration::from_millis(20)).await;
        }
    })
    .await;
}

#[tokio::test]
async fn health_and_page_answer() {
    let server = TestServer::start().await;
    let (status, health) = server.request("GET", "/api/health", None).await;
    assert_eq!((status, health["status"].as_str()), (200, Some("ok")));
    // 404 with the set-up hint where the page was not built.
    assert!([200, 404].contains(&server.request("GET", "/", None).await.0));
    assert_eq!(server.request("GET", "/../../Cargo.toml", None).await.0, 404);
}
