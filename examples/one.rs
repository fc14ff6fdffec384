use rungd::engine::{Engine, ScanTimes};
use rungd::isa::MemorySizes;
use rungd::lower;
use rungd::resolve::{LoadOptions, load_ladders};
use rungd::source::span::SourceFile;
use std::time::Instant;
fn text(kind: &str, n: usize) -> String {
    let mut s = String::from("[[program]]\nname=\"Main\"\n");
    for i in 0..n {
        let (a,b,c,d)=((i*7)%256,(i*13+5)%256,(i*3+1)%256,(i*5+2)%256);
        let x=match kind {
          "cnt" => format!("do=[\"CNT CT{i} up=[X{a}, !X{b}] rst=[X{c}, X{d}] preset=7\"]"),
          "cntdn" => format!("do=[\"CNTDN CT{i} up=[X{a}, !X{b}] rst=[X{c}, X{d}] preset=7\"]"),
          "on" => format!("when=[\"X{a}\",\"!X{b}\"]\ndo=[\"ONDTMR T{i} preset=7ms output=C{i}\"]"),
          "off" => format!("when=[\"X{a}\",\"!X{b}\"]\ndo=[\"OFFDTMR T{i} preset=7ms output=C{i}\"]"),
          "tmr" => format!("when=[\"X{a}\",\"!X{b}\"]\ndo=[\"TMR T{i} preset=7ms\"]"),
          "out" => format!("when=[\"X{a}\"]\ndo=[\"OUT C{i}\"]"),
          "out2" => format!("when=[\"X{a}\",\"!X{b}\"]\ndo=[\"OUT C{i}\"]"),
          _ => String::new()};
        s += &format!("[[program.rung]]\n{x}\n");
    }
    s
}
fn main() {
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    for kind in std::env::args().skip(2) {
        let t = text(&kind, n);
        let mut sizes = MemorySizes::default(); sizes.ct = sizes.ct.max(n as u32); sizes.t = sizes.t.max(n as u32); sizes.c = sizes.c.max(n as u32);
        let (p, f) = load_ladders(&[SourceFile{name:"x".into(),text:t}], &LoadOptions{sizes, ..LoadOptions::default()});
        let Some(p) = p else { println!("{kind}: {:?}", f.first()); continue };
        let mut e = Engine::new(lower::lower(&p).0);
        e.start(0);
        let mut best = vec![]; let mut now = 0u64; let mut r=12345u64;
        for _ in 0..400 {
            let scans=20000/n.max(1)+1;
            let t0=Instant::now();
            for _ in 0..scans {
                now += 1_000_000;
                e.begin_scan(now, &ScanTimes::default());
                for _ in 0..8 { r^=r<<13; r^=r>>7; r^=r<<17; e.set_input((r%256) as u32, r>>40 &1==1); }
                e.execute();
            }
            best.push(t0.elapsed().as_nanos() as f64/scans as f64);
        }
        best.sort_by(|a,b|a.total_cmp(b));
        println!("{kind:8} n={n} per scan {:.1} ns  per rung {:.3}", best[100], best[100]/n as f64);
    }
}
