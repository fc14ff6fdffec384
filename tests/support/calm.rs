//! A controller file that no busy machine brings to FAULT.

/// The text of a controller file, with a watchdog of 30 s where it names none: the usual 200 ms
/// are soon over for a process that waits for one of two busy cores.
pub fn calm(controller: &str) -> String {
    if controller.contains("watchdog = \"") {
        return controller.into();
    }
    match controller.split_once("[scan]\n") {
        Some((before, after)) => format!("{before}[scan]\nwatchdog = \"30s\"\n{after}"),
        None => format!("scan.watchdog = \"30s\"\n{controller}"),
    }
}

/// As [`calm`], of an example, which names a short watchdog.
pub fn calmed(controller: &str) -> String {
    let Some((before, after)) = controller.split_once("watchdog = \"") else {
        return calm(controller);
    };
    let (_, after) = after.split_once('"').expect("a text ends");
    format!("{before}watchdog = \"30s\"{after}")
}
