//! Requests for pictures of models: what is refused, and how. What they show is tested with a real GPU in `tests/`.

mod support;

use support::TestServer;

async fn refusal(server: &TestServer, path: &str) -> (u16, String) {
    let (status, answer) = server.request("GET", path, None).await;
    (status, answer["reason"].as_str().unwrap_or_default().to_owned())
}

#[tokio::test]
async fn a_picture_that_cannot_be_is_refused_with_its_reason() {
    let server = TestServer::start().await;
    server.open("a").await;
    let malformed = [
        "width=0",
        "width=100000",
        "height=-3",
        "height=huge",
        "eye=0,0,NaN&target=0,0,0",
        "eye=0,0,0",
        "pose=0,0,0,0,0,0,0",
        "opening_deg=NaN",
        "coloring=pink",
        "from=behind",
        "nonsense=1",
    ];
    for query in malformed {
        let found = refusal(&server, &format!("/api/sessions/a/view.png?{query}")).await;
        assert_eq!(found, (400, "malformed_message".into()), "{query}");
    }
    assert_eq!(refusal(&server, "/api/sessions/b/view.png").await, (404, "unknown_session".into()));
    assert_eq!(refusal(&server, "/api/finished/b.1/view.png").await, (404, "unknown_session".into()));
}

#[tokio::test]
async fn a_session_that_nobody_draws_says_so() {
    let server = TestServer::start().await;
    server.open("a").await;
    for file in ["view.png", "model.ply"] {
        let found = refusal(&server, &format!("/api/sessions/a/{file}")).await;
        assert_eq!(found, (503, "picture_unavailable".into()), "{file}");
    }
}

#[tokio::test]
async fn the_document_describes_the_query() {
    let server = TestServer::start().await;
    let (_, document) = server.request("GET", "/openapi.json", None).await;
    for path in ["/api/sessions/{id}/view.png", "/api/finished/{run}/view.png"] {
        let parameters = document["paths"][path]["get"]["parameters"].as_array().unwrap();
        for wanted in ["width", "height", "from", "eye", "target", "pose", "opening_deg", "coloring"] {
            assert!(
                parameters.iter().any(|found| found["name"] == wanted && found["in"] == "query"),
                "{wanted}"
            );
        }
    }
}
