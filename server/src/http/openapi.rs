//! Routes that describe themselves: the router and its OpenAPI document are made from the same list.

use axum::Router;
use axum::handler::Handler;
use axum::http::StatusCode;
use axum::routing::{MethodFilter, MethodRouter, on};
use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::{Map, Value, json};

use super::App;
use super::error::Refused;

/// Makes the schema of a type.
type SchemaOf = fn(&mut SchemaGenerator) -> Schema;

/// Routes as they are added, and what is said about them.
pub(super) struct Api {
    router: Router<App>,
    paths: Map<String, Value>,
    schemas: SchemaGenerator,
}

/// One method of a route.
pub(super) struct Operation {
    handler: MethodRouter<App>,
    method: &'static str,
    summary: &'static str,
    query: Option<SchemaOf>,
    body: Option<SchemaOf>,
    answer: (StatusCode, Option<SchemaOf>),
    refusals: &'static [StatusCode],
}

/// `GET`, answered by what `summary` says.
pub(super) fn get<H: Handler<T, App>, T: 'static>(handler: H, summary: &'static str) -> Operation {
    operation(("get", MethodFilter::GET), handler, summary)
}

/// `POST`.
pub(super) fn post<H: Handler<T, App>, T: 'static>(handler: H, summary: &'static str) -> Operation {
    operation(("post", MethodFilter::POST), handler, summary)
}

/// `PUT`.
pub(super) fn put<H: Handler<T, App>, T: 'static>(handler: H, summary: &'static str) -> Operation {
    operation(("put", MethodFilter::PUT), handler, summary)
}

/// `DELETE`.
pub(super) fn delete<H: Handler<T, App>, T: 'static>(handler: H, summary: &'static str) -> Operation {
    operation(("delete", MethodFilter::DELETE), handler, summary)
}

fn operation<H: Handler<T, App>, T: 'static>(
    (method, filter): (&'static str, MethodFilter),
    handler: H,
    summary: &'static str,
) -> Operation {
    let handler = on(filter, handler);
    Operation {
        handler,
        method,
        summary,
        query: None,
        body: None,
        answer: (StatusCode::OK, None),
        refusals: &[],
    }
}

impl Operation {
    /// Its body is this, in JSON.
    pub fn takes<T: JsonSchema>(self) -> Self {
        Self { body: Some(SchemaGenerator::subschema_for::<T>), ..self }
    }

    /// Its query has the fields of this.
    pub fn asks<T: JsonSchema>(self) -> Self {
        Self { query: Some(T::json_schema), ..self }
    }

    /// Its answer is this, in JSON.
    pub fn answers<T: JsonSchema>(self, status: StatusCode) -> Self {
        Self { answer: (status, Some(SchemaGenerator::subschema_for::<T>)), ..self }
    }

    /// Its answer is no JSON, or none at all.
    pub fn answers_with(self, status: StatusCode) -> Self {
        Self { answer: (status, None), ..self }
    }

    /// It may be refused with these, besides 401 and 403 where the server wants tokens.
    pub fn refuses(self, refusals: &'static [StatusCode]) -> Self {
        Self { refusals, ..self }
    }

    fn describe(&self, path: &str, schemas: &mut SchemaGenerator) -> Value {
        let mut responses = Map::new();
        let (status, schema) = self.answer;
        responses.insert(status.as_u16().to_string(), response(status, schema.map(|of| of(schemas))));
        for status in self.refusals {
            let refused = schemas.subschema_for::<Refused>();
            responses.insert(status.as_u16().to_string(), response(*status, Some(refused)));
        }
        let mut parameters = parameters(path);
        if let Some(query) = self.query {
            parameters.extend(query_parameters(&query(schemas)));
        }
        let mut described =
            json!({"summary": self.summary, "parameters": parameters, "responses": responses});
        if let Some(body) = self.body {
            let schema = body(schemas);
            described["requestBody"] =
                json!({"required": true, "content": {"application/json": {"schema": schema}}});
        }
        described
    }
}

fn response(status: StatusCode, schema: Option<Schema>) -> Value {
    let description = status.canonical_reason().unwrap_or_default();
    match schema {
        Some(schema) => {
            json!({"description": description, "content": {"application/json": {"schema": schema}}})
        }
        None => json!({"description": description}),
    }
}

/// The parts of a path in braces.
fn parameters(path: &str) -> Vec<Value> {
    let names = path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'));
    names
        .map(|name| json!({"name": name, "in": "path", "required": true, "schema": {"type": "string"}}))
        .collect()
}

/// The fields of a query, each with what it holds.
fn query_parameters(query: &Schema) -> Vec<Value> {
    let fields = query.get("properties").and_then(Value::as_object).into_iter().flatten();
    fields.map(|(name, schema)| json!({"name": name, "in": "query", "schema": schema})).collect()
}

impl Api {
    /// No route yet.
    pub fn new() -> Self {
        let schemas = SchemaSettings::openapi3().into_generator();
        Self { router: Router::new(), paths: Map::new(), schemas }
    }

    /// Adds a route with its methods.
    pub fn route(mut self, path: &str, operations: impl IntoIterator<Item = Operation>) -> Self {
        let (mut methods, mut described) = (MethodRouter::new(), Map::new());
        for operation in operations {
            described.insert(operation.method.to_owned(), operation.describe(path, &mut self.schemas));
            methods = methods.merge(operation.handler);
        }
        self.paths.insert(path.to_owned(), described.into());
        Self { router: self.router.route(path, methods), ..self }
    }

    /// The router, and the document of what it serves.
    pub fn finish(mut self) -> (Router<App>, Value) {
        let document = json!({
            "openapi": "3.0.3",
            "info": {"title": "MIS-SLAM server", "version": env!("CARGO_PKG_VERSION")},
            "paths": self.paths,
            "components": {"schemas": self.schemas.take_definitions(true)},
        });
        (self.router, document)
    }
}
