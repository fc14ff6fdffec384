//! Controller files with a watchdog so long that a busy machine does not cause a FAULT.

/// The text of a controller file, with a watchdog of ten minutes if the text sets none: a process that
/// waits for one of two busy cores easily exceeds the default of 200 ms.
pub fn calm(controller: &str) -> String {
    if controller.contains("watchdog = \"") {
        return controller.into();
    }
    match controller.split_once("[scan]\n") {
        Some((before, after)) => format!("{before}[scan]\nwatchdog = \"10m\"\n{after}"),
        None => format!("scan.watchdog = \"10m\"\n{controller}"),
    }
}

/// As [`calm`], but also replaces a short watchdog that the text sets, as the examples do.
pub fn calmed(controller: &str) -> String {
    let Some((before, after)) = controller.split_once("watchdog = \"") else {
        return calm(controller);
    };
    let (_, after) = after.split_once('"').expect("a text ends");
    format!("{before}watchdog = \"10m\"{after}")
}
