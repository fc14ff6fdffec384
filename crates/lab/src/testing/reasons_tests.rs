//! The reasons in a failure for the tags of an observer and for `was(x)`.

use super::runner::{RunOptions, programs, run};
use super::was_tests::{scenario, suite};

const OBSERVER: &str = "[observer.tags]\nwaits = { type = \"timer\", doc = \"No pusher\" }
    count = { type = \"int\" }\nown = { type = \"bit\" }
    [[observer.rung]]\nname = \"wait\"\nwhen = [\"start\", \"!pusher\"]
    do = [\"TMR waits preset=50ms\"]
    [[observer.rung]]\nwhen = [\"waits.Done & level > 3\"]\ndo = [\"OUT own\"]
    [[observer.rung]]\nwhen = [\"rise(pusher)\"]\ndo = [\"ADD count 1 to=count\"]\n";

/// The reasons of the first failure of a scenario.
fn reasons(steps: &str) -> String {
    let suite = suite(&format!("{OBSERVER}{}", scenario(steps)));
    let options = RunOptions { jobs: 1, filter: None, progress: &|_, _| {}, given_up: None };
    let verdicts = run(&suite, &programs(&suite), &options);
    let why = verdicts[0].failure.as_ref().expect("it fails").why.join("\n");
    why.replace(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/suites/crates.toml"), "")
}

#[test]
fn the_tags_of_the_observer_are_explained_by_its_rungs_and_those_by_the_ladder() {
    let steps = "run 1 scans\nset level 9\nset start 1\nrun 20 scans\nexpect: !own";
    expect_test::expect![[r#"
        own is ON
          OUT own keeps it ON: the observer, rung 2, x.test.toml:12
            the rung is ON, because
              waits.Done is ON
                TMR waits preset=50ms keeps it ON: the observer, rung wait, x.test.toml:9
                done for 140 ms, since scan 7: 190 ms of 50 ms
                  the rung is ON, because
                    start (X2) is ON
                      input X2 turned it ON 190 ms ago, in scan 2
                    pusher (Y0) is OFF
                      OUT pusher keeps it OFF: Main, rung 2, :35
                        the rung is OFF, because
                          bottles.Done is OFF …
              level > 3 is ON: level = 9.0
                level is 9.0
                  the step `set level 9` wrote 9.0 190 ms ago, in scan 2
    "#]]
    .assert_eq(&reasons(steps));
}

#[test]
fn a_count_of_the_observer_is_explained_by_what_it_counted() {
    let steps = "run 1 scans\npulse bottle 10ms every 20ms times 3\nexpect: count == 0";
    expect_test::expect![[r#"
        count is 1
          ADD count 1 to=count made it 1 10 ms ago, in scan 6: the observer, rung 3, x.test.toml:15
            the rung was ON, because
              rise(pusher) was ON
                inside: pusher (Y0) was ON
                  OUT pusher turned it ON 10 ms ago, in scan 6: Main, rung 2, :35
                    the rung was ON, because
                      bottles.Done was ON
                        CNT bottles preset=size turned it ON 10 ms ago, in scan 6: Main, rung 1, :31
                        3 of 3, last counted 10 ms ago, in scan 6, last reset 60 ms ago, in scan 1
                          up was ON, because
                            bottle (X0) was ON
                              input X0 turned it ON 10 ms ago, in scan 6
                          rst was OFF, because
                            in_front (X1) was OFF
                              until then unchanged since rungd started: its initial value
                            $FirstScan was OFF
                              the controller writes it at the start of every scan
                          with size = 3
                            until then unchanged since rungd started: its initial value
            with count = 0
              until then unchanged since rungd started: its initial value
          ADD count 1 to=count could change it, but does not: the observer, rung 3, x.test.toml:15
            the rung is OFF, because
              rise(pusher) is OFF; last ON 10 ms ago, in scan 6
                inside: pusher (Y0) is ON (see above)
    "#]]
    .assert_eq(&reasons(steps));
}

#[test]
fn was_x_is_explained_at_the_end_of_the_scan_before() {
    let steps = "run 4 scans\nset level 9\nrun 1 scans\nexpect: was(level) == level & !was(own)";
    expect_test::expect![[r#"
        was(level) is 0.0
          unchanged since rungd started: its initial value

        level is 9.0
          the step `set level 9` wrote 9.0 in this scan
    "#]]
    .assert_eq(&reasons(steps));
}

#[test]
fn behind_a_new_process_the_observer_is_explained_within_it() {
    let steps = "run 1 scans\nset start 1\nset level 9\nrun 20 scans\nrestart\nrun 2 scans\n\
                 expect: !waits.Done";
    expect_test::expect![[r#"
        waits.Done is ON
          TMR waits preset=50ms keeps it ON: the observer, rung wait, x.test.toml:9
          done: 220 ms of 50 ms
            the rung is ON, because
              start (X2) is ON
                input X2 turned it ON 10 ms ago, in scan 1
              pusher (Y0) is OFF
                OUT pusher keeps it OFF: Main, rung 2, :35
                  the rung is OFF, because
                    bottles.Done is OFF
                      CNT bottles preset=size keeps it OFF: Main, rung 1, :31
                      0 of 3, not counted since rungd started, last reset 10 ms ago, in scan 1
                        up is OFF, because
                          bottle (X0) is OFF
                            unchanged since rungd started: its initial value
                        rst is OFF, because
                          in_front (X1) is OFF
                            unchanged since rungd started: its initial value
                          $FirstScan is OFF
                            the controller writes it at the start of every scan
                        with size = 3
                          unchanged since rungd started: its initial value
    "#]]
    .assert_eq(&reasons(steps));
}
