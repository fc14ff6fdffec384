//! Sessions with a cluster of three NATS servers. One server is killed or paused, and comes back.

use std::time::Duration;

use tokio::time::timeout;

use rungd_net::mqtt::{BrokerSettings, MqttCause, MqttEvent, MqttSession, MqttVersion, Qos};

use crate::fleet::nats::NatsCluster;
use crate::fleet::sessions::{confirmed, message, refusal, run, settings};

/// The wait before a request is repeated.
const AGAIN: Duration = Duration::from_secs(2);

/// A session with a server that may have no leader now: retries until it begins.
async fn session(settings: &BrokerSettings) -> MqttSession {
    loop {
        match MqttSession::connect(settings, &settings.addresses[0], None).await {
            Ok(session) => return session,
            Err(failure) => eprintln!("again: {failure}"),
        }
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

#[test]
fn a_message_of_one_node_arrives_at_another_while_the_third_is_down() {
    let Some(mut cluster) = NatsCluster::start() else { return };
    let urls = cluster.urls();
    let of = |n: usize| settings(&urls[n], MqttVersion::V3, &format!("client-{n}"));
    run(async {
        let mut reader = session(&of(0)).await;
        reader.subscribe(&[("plant/#", Qos::AtLeastOnce)]).await.unwrap();
        let mut writer = session(&of(1)).await;
        let number = writer.publish("plant/1", b"1", Qos::AtLeastOnce, true).await.unwrap();
        assert_eq!(confirmed_with(&mut writer).await, number);
        assert_eq!(message(&mut reader).await.1, b"1");

        let mut third = session(&of(2)).await;
        cluster.kill(2);
        let failure = third.next().await.unwrap_err();
        let gone = matches!(failure.cause, MqttCause::Closed | MqttCause::Broken(_));
        assert!(gone, "{failure}");
        // A message with QoS 0 may be lost until the cluster notices the dead server.
        let heard = loop {
            writer.publish("plant/2", b"2", Qos::AtMostOnce, false).await.unwrap();
            assert_eq!(confirmed(&mut writer).await, []);
            match timeout(AGAIN, message(&mut reader)).await {
                Ok(heard) => break heard.1,
                Err(_) => continue,
            }
        };
        assert_eq!(heard, b"2");

        cluster.start_again(2);
        assert!(cluster.waits_for(2), "{}", cluster.said(2));
        let mut third = session(&of(2)).await;
        // At a server that has just come back, retained messages may be missing for seconds.
        let kept = loop {
            third.subscribe(&[("plant/1", Qos::AtMostOnce)]).await.unwrap();
            match timeout(AGAIN, message(&mut third)).await {
                Ok(kept) => break kept,
                Err(_) => continue,
            }
        };
        assert_eq!(kept, ("plant/1".to_owned(), b"1".to_vec(), true));
    });
}

/// The number of the next acknowledgement.
async fn confirmed_with(session: &mut MqttSession) -> Option<u16> {
    loop {
        if let MqttEvent::Acknowledged(number) = session.next().await.unwrap() {
            return Some(number);
        }
    }
}

#[test]
fn a_paused_server_is_detected_and_mqtt_5_is_refused_with_a_reason() {
    let Some(cluster) = NatsCluster::start() else { return };
    let urls = cluster.urls();
    run(async {
        let failure = refusal(&settings(&urls[0], MqttVersion::V5, "five")).await;
        assert!(failure.to_string().contains("version of MQTT"), "{failure}");
        let mut short = settings(&urls[1], MqttVersion::V3, "held");
        short.keepalive = Duration::from_secs(2);
        let mut held = session(&short).await;
        cluster.stop(1);
        let failure = held.next().await;
        let failure = failure.expect_err("nothing comes");
        assert!(failure.is_silent(), "{failure}");
        cluster.cont(1);
        session(&short).await.disconnect().await.unwrap();
    });
}
