//! TLS with certificates on both sides, and passwords: who is accepted, and the errors of those who
//! are refused.

use rungd_net::mqtt::{BrokerLogin, BrokerSettings, MqttCause, MqttVersion, TlsFiles};

use crate::fleet::certificates::Certificates;
use crate::fleet::mosquitto::{Mosquitto, MosquittoOptions};
use crate::fleet::sessions::{confirmed, refusal, run, session, settings};
use rungd_test_support::folder::TestFolder;

const VERSIONS: [MqttVersion; 2] = [MqttVersion::V3, MqttVersion::V5];

fn files(certificates: &Certificates) -> TlsFiles {
    TlsFiles {
        ca: Some(certificates.ca.clone()),
        certificate: Some(certificates.client.clone()),
        key: Some(certificates.client_key.clone()),
    }
}

#[test]
fn client_and_broker_verify_each_other() {
    let options = MosquittoOptions { tls: true, ..MosquittoOptions::default() };
    let Some(broker) = Mosquitto::start(&options) else { return };
    let ours = files(broker.certificates.as_ref().unwrap());
    let of = |tls: &TlsFiles| {
        let settings = settings(&broker.url(), MqttVersion::V5, "secured");
        BrokerSettings { tls: Some(tls.clone()), ..settings }
    };
    let insecure = |failure: rungd_net::mqtt::MqttFailure| {
        assert!(matches!(failure.cause, MqttCause::Insecure(_)), "{failure}");
        failure.to_string()
    };
    run(async {
        let mut good = session(&of(&ours)).await;
        assert_eq!(confirmed(&mut good).await, []);
        good.disconnect().await.unwrap();
        // Without a client certificate.
        insecure(refusal(&of(&TlsFiles { ca: ours.ca.clone(), ..TlsFiles::default() })).await);
        // An authority that did not sign the broker's certificate.
        let folder = TestFolder::new("strangers");
        let strangers = files(&Certificates::make(folder.path()));
        let unknown = TlsFiles { ca: strangers.ca.clone(), ..ours.clone() };
        assert!(insecure(refusal(&of(&unknown)).await).contains("invalid peer certificate"));
        // A client certificate that the broker's authority did not sign.
        insecure(refusal(&of(&TlsFiles { ca: ours.ca.clone(), ..strangers })).await);
        // The broker's address with a name that its certificate lacks.
        let mut other_name = of(&ours);
        other_name.addresses[0].host = "127.0.0.1".to_owned();
        assert!(insecure(refusal(&other_name).await).contains("127.0.0.1"));
        let mut plain = of(&ours);
        plain.addresses[0].tls = false;
        let failure = refusal(&plain).await;
        assert!(matches!(failure.cause, MqttCause::Settings(_)), "{failure}");
        assert!(failure.to_string().contains("`mqtts://`"), "{failure}");
    });
}

#[test]
fn a_wrong_certificate_file_is_named() {
    let options = MosquittoOptions { tls: true, ..MosquittoOptions::default() };
    let Some(broker) = Mosquitto::start(&options) else { return };
    let ours = files(broker.certificates.as_ref().unwrap());
    let with = |change: &dyn Fn(&mut TlsFiles)| {
        let mut tls = ours.clone();
        change(&mut tls);
        let settings = settings(&broker.url(), MqttVersion::V3, "files");
        BrokerSettings { tls: Some(tls), ..settings }
    };
    run(async {
        let named = |failure: rungd_net::mqtt::MqttFailure, word: &str| {
            assert!(failure.to_string().contains(word), "{failure}");
        };
        let gone = with(&|tls| tls.ca = Some("/nonexistent/ca.pem".into()));
        named(refusal(&gone).await, "/nonexistent/ca.pem");
        let no_ca = with(&|tls| tls.ca = tls.key.clone());
        named(refusal(&no_ca).await, "client.key");
        let no_key = with(&|tls| tls.key = None);
        named(refusal(&no_key).await, "without `key`");
        let wrong_key = with(&|tls| tls.key = tls.certificate.clone());
        named(refusal(&wrong_key).await, "client.pem");
    });
}

#[test]
fn a_wrong_password_is_reported_in_words() {
    let login = Some(("plant", "sesame"));
    let options = MosquittoOptions { login, ..MosquittoOptions::default() };
    let Some(broker) = Mosquitto::start(&options) else { return };
    for version in VERSIONS {
        run(async {
            let of = |password: &str| {
                let user = "plant".to_owned();
                let login = Some(BrokerLogin { user, password: password.to_owned() });
                BrokerSettings { login, ..settings(&broker.url(), version, "login") }
            };
            session(&of("sesame")).await.disconnect().await.unwrap();
            let failure = refusal(&of("open")).await;
            assert!(matches!(failure.cause, MqttCause::Refused(..)), "{failure}");
            let said = failure.to_string();
            assert!(said.contains("refused") && said.contains("login"), "{said}");
            assert!(!format!("{:?}", of("sesame")).contains("sesame"));
        });
    }
}
