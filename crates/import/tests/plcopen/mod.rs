//! PLCopen: the tests' own interpreter of ladders, made from the tables of the standard, random
//! ladders for both, and named cases.

mod blocks;
mod cases;
mod chart;
mod chart_bodies;
mod chart_cases;
mod chart_generator;
mod chart_reading;
mod counter;
mod equality;
mod files;
mod function_cases;
mod functions;
mod generator;
mod hostile;
pub mod interpreter;
mod kinds;
mod reading;
mod tables;
pub mod values;

/// A file with a program of these variables and this ladder; the left rail is the element 1.
pub fn file(variables: &str, ladder: &str) -> String {
    format!(
        "<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\"><types><pous><pou name=\"prog\" \
         pouType=\"program\"><interface><localVars>{variables}</localVars></interface><body><LD>\
         <leftPowerRail localId=\"1\"><position x=\"0\" \
            y=\"0\"/></leftPowerRail>{ladder}</LD></body>\
         </pou></pous></types></project>"
    )
}
