//! Intel's matrix units (AMX): whether they may be used, and their tile registers, eight of 16 rows of 64 bytes.

use std::{arch::asm, sync::OnceLock};

/// Lays the thread's tile registers out.
///
/// # Safety
/// [`is_available`] has said yes.
#[inline(always)]
pub unsafe fn configure() {
    // SAFETY: the caller has AMX, and the configuration is 64 bytes.
    unsafe { asm!("ldtilecfg [{}]", in(reg) &raw const CONFIGURATION, options(nostack, readonly)) }
}

/// Gives the thread's tile registers back: the system saves them no more.
///
/// # Safety
/// [`is_available`] has said yes.
#[inline(always)]
pub unsafe fn release() {
    // SAFETY: the caller has AMX.
    unsafe { asm!("tilerelease", options(nostack, nomem)) }
}

/// Palette 1; bytes of a row from the 16th on, rows from the 48th on.
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

/// Does the processor have the units, and does the system let this process use them? It is asked once.
pub fn is_available() -> bool {
    static AVAILABLE: OnceLock<bool> = OnceLock::new();
    *AVAILABLE.get_or_init(|| has_units() && is_permitted())
}

/// AMX-TILE, AMX-INT8 and AMX-BF16 (CPUID leaf 7, EDX bits 24, 25 and 22).
fn has_units() -> bool {
    use std::arch::x86_64::{__cpuid, __cpuid_count};
    let units = 1 << 24 | 1 << 25 | 1 << 22;
    __cpuid(0).eax >= 7 && __cpuid_count(7, 0).edx & units == units
}

/// Linux keeps the registers' 8 KiB out of a process until it asks for them (arch_prctl).
#[cfg(target_os = "linux")]
fn is_permitted() -> bool {
    const ARCH_PRCTL: i64 = 158;
    const ARCH_REQ_XCOMP_PERM: i64 = 0x1023;
    const XFEATURE_XTILEDATA: i64 = 18;
    let status: i64;
    // SAFETY: a system call that reads and writes no memory of ours; unknown ones fail.
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
