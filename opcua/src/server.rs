//! The server: its limits, its endpoints, and the loop that shows what the controller reports.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use anyhow::{Context as _, Result, anyhow, bail};
use opcua::crypto::SecurityPolicy;
use opcua::server::diagnostics::DiagnosticsNodeManagerBuilder;
use opcua::server::node_manager::ServerContext;
use opcua::server::node_manager::memory::{CoreNodeManagerBuilder, InMemoryNodeManagerBuilder};
use opcua::server::{
    ANONYMOUS_USER_TOKEN_ID, Limits, OperationalLimits, Server, ServerBuilder, ServerEndpoint,
    ServerHandle, SubscriptionLimits,
};
use opcua::types::{BuildInfo, MessageSecurityMode, UAString};
use rungd_fleet::opcua::OpcUaSettings;
use rungd_web::UserDirectory;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::mpsc::Receiver;
use tokio::task::JoinHandle;
use tokio::time::{Duration, interval, sleep};

use crate::alarms::StandingAlarms;
use crate::certificates::{make_own, prune_rejected};
use crate::conditions::ConditionMethods;
use crate::follow::{self, PlantController, PlantReport};
use crate::gate::{ClientGate, GateTerms, inner_address};
use crate::journal::{ServerLines, say};
use crate::manager::{PlantManagerBuilder, PlantNodes};
use crate::publish::Publisher;
use crate::shelving::ShelfMethods;
use crate::types::InheritingTypes;
use crate::users::ServerUsers;

/// The policies that are offered with encryption: none that the standard has withdrawn.
const POLICIES: [SecurityPolicy; 3] = [
    SecurityPolicy::Aes256Sha256RsaPss,
    SecurityPolicy::Aes128Sha256RsaOaep,
    SecurityPolicy::Basic256Sha256,
];
/// The longest message of a client, bytes, and the most pieces of it.
const MESSAGE: (usize, usize) = (4 << 20, 512);
/// The shortest publishing interval, ms.
const PUBLISHING_MS_MIN: u64 = 50;
/// The time between two looks for subscriptions whose interval is over, ms. Each interval lasts
/// until the next look: with a rare look an interval of 100 ms was up to twice as long, and a
/// client waited for a sign of life in vain.
const PUBLISHING_LOOK_MS: u64 = 10;
const _: () = assert!(PUBLISHING_LOOK_MS * 5 <= PUBLISHING_MS_MIN);
/// How long a request to publish waits if the client names no time, which by the standard is
/// without an end, ms.
const PUBLISH_WAIT_MS: u64 = 24 * 60 * 60 * 1000;
/// The time between two looks for withheld lines and old certificates.
const HOUSEKEEPING: Duration = Duration::from_secs(2);
/// The time for sessions to end.
const END_MAX: Duration = Duration::from_secs(2);

/// Serves until the process receives a signal to end.
///
/// # Errors
/// The certificates cannot be made, the address is not free, or the system refuses a thread.
pub fn run(settings: &OpcUaSettings) -> Result<()> {
    if make_own(settings)? {
        let folder = settings.certificates.display();
        say(&format!("made this server's certificate and its key in {folder}"));
    }
    let mut runtime = tokio::runtime::Builder::new_multi_thread();
    let runtime = runtime.worker_threads(2).enable_all().build().context("an event loop")?;
    runtime.block_on(serve(settings))
}

async fn serve(settings: &OpcUaSettings) -> Result<()> {
    let lines = ServerLines::new();
    let followed = PlantController::new(settings.socket.clone());
    let standing = StandingAlarms::default();
    let methods = ConditionMethods {
        followed: followed.clone(),
        lines: lines.clone(),
        may_acknowledge: settings.may_acknowledge,
        shelves: ShelfMethods {
            followed: followed.clone(),
            lines: lines.clone(),
            may_shelve: settings.may_shelve,
        },
        standing: Arc::clone(&standing),
    };
    let (server, handle) = made(settings, followed.clone(), methods)?;
    let nodes = handle.node_managers().get_of_type::<PlantNodes>();
    let nodes = nodes.ok_or_else(|| anyhow!("the nodes of the controller are missing"))?;
    let reports = follow::start(settings, followed).context("a thread")?;
    let gated = gated(settings, server, &handle, lines.clone()).await?;
    say(&format!("serves {} ({})", settings.url(), how_secure(settings)));
    let _ = sd_notify::notify(&[sd_notify::NotifyState::Ready]);
    let publisher = Publisher::new(handle.clone(), nodes, standing);
    let clients = tokio::spawn(gated.gate.serve(gated.public));
    let shown = show(publisher, reports, settings, &lines).await;
    clients.abort();
    handle.cancel();
    let _ = tokio::time::timeout(END_MAX, gated.serving).await;
    lines.report_withheld(true);
    say("ends after a signal");
    shown
}

/// The server, the gate before it, and the address at which clients come.
struct GatedServer {
    public: TcpListener,
    gate: Arc<ClientGate>,
    serving: JoinHandle<Result<(), String>>,
}

/// Starts the server behind its gate.
async fn gated(
    settings: &OpcUaSettings,
    server: Server,
    handle: &ServerHandle,
    lines: ServerLines,
) -> Result<GatedServer> {
    let public = TcpListener::bind(settings.listen).await;
    let public = public.with_context(|| format!("cannot listen at {}", settings.listen))?;
    let inner = TcpListener::bind(inner_address()).await.context("a port of the loopback")?;
    let terms = GateTerms {
        inner: inner.local_addr()?,
        insecure: settings.insecure,
        certificates: settings.certificates.clone(),
        sessions: settings.sessions,
    };
    let serving = tokio::spawn(server.run_with(inner));
    // The server notes its own port when it begins; clients are told that of the gate.
    let port = &handle.info().port;
    while port.load(Ordering::Relaxed) == 0 {
        if serving.is_finished() {
            bail!("the server has ended at its start");
        }
        sleep(Duration::from_millis(1)).await;
    }
    port.store(public.local_addr()?.port(), Ordering::Relaxed);
    Ok(GatedServer { public, gate: Arc::new(ClientGate::new(terms, lines)), serving })
}

fn how_secure(settings: &OpcUaSettings) -> String {
    let encrypted = match settings.insecure {
        true => "with and without encryption",
        false => "with encryption",
    };
    let users = match settings.users {
        Some(_) => "users sign in",
        None => "nobody has to sign in",
    };
    format!("{encrypted}, {users}")
}

/// Shows the reports until a signal to end.
async fn show(
    mut publisher: Publisher,
    mut reports: Receiver<PlantReport>,
    settings: &OpcUaSettings,
    lines: &ServerLines,
) -> Result<()> {
    let mut ends = [signal(SignalKind::terminate())?, signal(SignalKind::interrupt())?];
    let [terminate, interrupt] = &mut ends;
    let mut house = interval(HOUSEKEEPING);
    loop {
        tokio::select! {
            report = reports.recv() => match report {
                Some(report) => publisher.take(report),
                None => return Err(anyhow!("the thread that follows the controller has ended")),
            },
            _ = house.tick() => {
                lines.report_withheld(false);
                prune_rejected(&settings.certificates);
            }
            _ = terminate.recv() => return Ok(()),
            _ = interrupt.recv() => return Ok(()),
        }
    }
}

fn made(
    settings: &OpcUaSettings,
    followed: PlantController,
    methods: ConditionMethods,
) -> Result<(Server, ServerHandle)> {
    let lines = methods.lines.clone();
    let users = ServerUsers::new(settings.users.clone().map(UserDirectory::new), lines.clone());
    let manager = PlantManagerBuilder { settings: settings.clone(), followed, lines };
    let mut builder = ServerBuilder::new()
        // The first manager that owns a method carries it out, so those of conditions stand first.
        .without_node_managers()
        .with_node_manager(move |_: ServerContext| methods)
        .with_node_manager(InMemoryNodeManagerBuilder::new(CoreNodeManagerBuilder))
        .with_node_manager(DiagnosticsNodeManagerBuilder)
        .application_name(format!("rungd {}", settings.name))
        .application_uri(settings.application_uri())
        .product_uri("urn:rungd")
        .host(settings.host.clone())
        .port(settings.listen.port())
        .pki_dir(&settings.certificates)
        .create_sample_keypair(false)
        .trust_client_certs(false)
        .discovery_urls(vec![settings.url()])
        .build_info(build_info())
        .limits(limits(settings))
        .subscription_poll_interval_ms(PUBLISHING_LOOK_MS)
        .publish_timeout_default_ms(PUBLISH_WAIT_MS)
        .max_sessions(settings.sessions)
        .with_authenticator(Arc::new(users))
        .with_type_tree_getter(Arc::new(InheritingTypes))
        .with_node_manager(InMemoryNodeManagerBuilder::new(manager));
    for (name, endpoint) in endpoints(settings) {
        builder = builder.add_endpoint(name, endpoint);
    }
    builder.build().map_err(anyhow::Error::msg)
}

/// The endpoints, each with its name.
fn endpoints(settings: &OpcUaSettings) -> Vec<(String, ServerEndpoint)> {
    // Which kind of user an endpoint takes is decided by `ServerUsers`; the library wants one.
    let users = [ANONYMOUS_USER_TOKEN_ID.to_owned()];
    let encrypted = POLICIES.map(|policy| {
        let mode = MessageSecurityMode::SignAndEncrypt;
        (policy.to_string(), ServerEndpoint::new("/", policy, mode, &users))
    });
    let mut all: Vec<(String, ServerEndpoint)> = encrypted.into();
    if settings.insecure {
        all.push(("none".to_owned(), ServerEndpoint::new_none("/", &users)));
    }
    all
}

fn build_info() -> BuildInfo {
    let version = UAString::from(env!("CARGO_PKG_VERSION"));
    BuildInfo {
        product_uri: UAString::from("urn:rungd"),
        manufacturer_name: UAString::from("rungd"),
        product_name: UAString::from("rungd-opcua"),
        software_version: version.clone(),
        build_number: version,
        ..BuildInfo::default()
    }
}

/// The limits for each client, known or not.
fn limits(settings: &OpcUaSettings) -> Limits {
    Limits {
        max_array_length: 100_000,
        max_string_length: 65_536,
        max_byte_string_length: 1 << 20,
        max_message_size: MESSAGE.0,
        max_chunk_count: MESSAGE.1,
        max_sessions: settings.sessions,
        subscriptions: SubscriptionLimits {
            max_subscriptions_per_session: 20,
            // Every change of a scan is told; a client with a longer interval asks for it.
            min_sampling_interval_ms: 0.0,
            min_publishing_interval_ms: PUBLISHING_MS_MIN as f64,
            max_monitored_items_per_sub: 20_000,
            max_monitored_item_queue_size: 10_000,
            ..SubscriptionLimits::default()
        },
        // Each keeps what is left of the references of a node.
        max_browse_continuation_points: 5,
        max_query_continuation_points: 1,
        operational: OperationalLimits {
            max_nodes_per_browse: 100,
            max_nodes_per_history_read_data: 100,
            ..OperationalLimits::default()
        },
        ..Limits::default()
    }
}
