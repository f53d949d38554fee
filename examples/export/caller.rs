// The exported library called from Rust.
//
//     asperity export sinusoid:amplitude=0.1mm,period=2mm --law C --shared -o texture.h
//     cmake -B build . && cmake --build build
//     rustc --edition 2021 -O caller.rs -L build && LD_LIBRARY_PATH=build ./caller
//
// With the names of two files, it reads positions from one and writes the forces to the other:
// doubles, three for each tick.
use std::ffi::CStr;
use std::os::raw::{c_char, c_int};

const ABI: c_int = 1;

/// What the library holds: texture_facts.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Facts {
    pub size: u32,
    pub abi: u32,
    pub real_size: u32,
    pub state_size: u32,
    pub stiffness: f64,
    pub max_depth: f64,
    pub q: f64,
    pub q_plus: f64,
    pub max_force: f64,
    pub max_press: f64,
    pub friction: f64,
    pub presliding_stiffness: f64,
    pub friction_modulation: f64,
    pub max_deflection: f64,
    pub holds_deeper: i32,
    pub precision: [c_char; 12],
    pub content: [c_char; 24],
    pub law: [c_char; 64],
}

#[link(name = "texture")]
extern "C" {
    fn texture_abi_version() -> c_int;
    fn texture_info(facts: *mut Facts) -> u32;
    fn texture_reset(state: *mut u64);
    fn texture_force(state: *mut u64, position: *const f64, force: *mut f64);
}

/// A contact: the library, asked, and a state.
pub struct Texture {
    pub facts: Facts,
    state: Vec<u64>,
}

impl Texture {
    pub fn new() -> Result<Texture, String> {
        // All fields are numbers.
        let mut facts: Facts = unsafe { std::mem::zeroed() };
        facts.size = std::mem::size_of::<Facts>() as u32;
        let abi = unsafe { texture_abi_version() };
        if abi != ABI {
            return Err(format!("the library has ABI {}, this program ABI {}", abi, ABI));
        }
        unsafe { texture_info(&mut facts) };
        if facts.real_size != 8 {
            let precision = unsafe { CStr::from_ptr(facts.precision.as_ptr()) };
            return Err(format!("the library takes {:?}, this program double", precision));
        }
        let mut state = vec![0u64; (facts.state_size as usize + 7) / 8];
        unsafe { texture_reset(state.as_mut_ptr()) };
        Ok(Texture { facts, state })
    }

    pub fn force(&mut self, position: &[f64; 3]) -> [f64; 3] {
        let mut force = [0.0; 3];
        unsafe { texture_force(self.state.as_mut_ptr(), position.as_ptr(), force.as_mut_ptr()) };
        force
    }
}

fn convert(texture: &mut Texture, from: &str, to: &str) -> std::io::Result<()> {
    let mut forces = Vec::new();
    for row in std::fs::read(from)?.chunks_exact(24) {
        let mut position = [0.0; 3];
        for (number, bytes) in position.iter_mut().zip(row.chunks_exact(8)) {
            *number = f64::from_ne_bytes(bytes.try_into().unwrap());
        }
        for number in texture.force(&position) {
            forces.extend(number.to_ne_bytes());
        }
    }
    std::fs::write(to, forces)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut texture = Texture::new()?;
    let files: Vec<String> = std::env::args().skip(1).collect();
    if files.len() == 2 {
        return Ok(convert(&mut texture, &files[0], &files[1])?);
    }
    for tick in 0..5 {
        let force = texture.force(&[0.25e-3 * f64::from(tick), 0.1e-3, -0.05e-3]);
        println!("{:e} {:e} {:e}", force[0], force[1], force[2]);
    }
    Ok(())
}
