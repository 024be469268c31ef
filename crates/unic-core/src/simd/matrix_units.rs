//! Intel's matrix units (AMX): detection and the configuration of their tile registers.
//!
//! For the kernels of this crate and of training. All eight tile registers have 16 rows of 64
//! bytes.

use std::{arch::asm, sync::OnceLock};

/// Configures the tile registers of the calling thread.
///
/// # Safety
/// [`is_available`] returns true.
#[inline(always)]
pub unsafe fn configure() {
    // SAFETY: the machine has AMX, and the configuration is 64 bytes long.
    unsafe { asm!("ldtilecfg [{}]", in(reg) &raw const CONFIGURATION, options(nostack, readonly)) }
}

/// Releases the tile registers of the calling thread, so that context switches no longer save them.
///
/// # Safety
/// [`is_available`] returns true.
#[inline(always)]
pub unsafe fn release() {
    // SAFETY: the machine has AMX.
    unsafe { asm!("tilerelease", options(nostack, nomem)) }
}

/// Operand of `ldtilecfg`: the palette in byte 0, bytes a row of each register from byte 16 on (two
/// bytes each), rows of each register from byte 48 on.
#[repr(C, align(64))]
struct Configuration([u8; 64]);

static CONFIGURATION: Configuration = Configuration(configuration());

const fn configuration() -> [u8; 64] {
    let mut bytes = [0; 64];
    bytes[0] = 1;
    let mut register = 0;
    while register < 8 {
        bytes[16 + 2 * register] = 64;
        bytes[48 + register] = 16;
        register += 1;
    }
    bytes
}

/// Returns whether the processor has the units and the system lets this process use them.
pub fn is_available() -> bool {
    // The system is asked once: its permission holds for the process.
    static AVAILABLE: OnceLock<bool> = OnceLock::new();
    *AVAILABLE.get_or_init(|| has_units() && is_permitted())
}

/// Detects AMX-TILE, AMX-INT8 and AMX-BF16 (CPUID leaf 7, EDX bits 24, 25 and 22).
fn has_units() -> bool {
    use std::arch::x86_64::{__cpuid, __cpuid_count};
    let units = 1 << 24 | 1 << 25 | 1 << 22;
    __cpuid(0).eax >= 7 && __cpuid_count(7, 0).edx & units == units
}

/// Asks Linux for the 8 KiB of tile registers, which a process has only after it asked
/// (arch_prctl).
#[cfg(target_os = "linux")]
fn is_permitted() -> bool {
    const ARCH_PRCTL: i64 = 158;
    const ARCH_REQ_XCOMP_PERM: i64 = 0x1023;
    const XFEATURE_XTILEDATA: i64 = 18;
    let status: i64;
    // SAFETY: the system call reads and writes no memory of the process; old kernels, which do not
    // know it, return an error.
    unsafe {
        asm!(
            "syscall",
            inlateout("rax") ARCH_PRCTL => status,
            in("rdi") ARCH_REQ_XCOMP_PERM,
            in("rsi") XFEATURE_XTILEDATA,
            out("rcx") _,
            out("r11") _,
            options(nostack)
        );
    }
    status == 0
}

#[cfg(not(target_os = "linux"))]
fn is_permitted() -> bool {
    false
}
