//! One update of each trunk.
fn main() {
    divan::main();
}
