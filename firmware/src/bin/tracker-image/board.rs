//! The STM32F405's registers: serial port, free-running counter, watchdog, memory in use.
//!
//! The only module of the image that touches hardware. The board runs from its 16 MHz internal
//! oscillator, so no crystal is assumed. QEMU's `netduinoplus2` has the port and the counter; it
//! ignores writes to the clock, pin and watchdog registers, so those three are unproven there.
#![allow(unsafe_code)]

use core::ptr::{read_volatile, write_volatile};

use bnkf::protocol::BudgetFrame;
use cortex_m_rt::STACK_PAINT_VALUE;

const CLOCK_HZ: u32 = 16_000_000;
const BAUD: u32 = 115_200;
/// Counted by the watchdog's own 32 kHz oscillator; 32 is the most it can do. A step of 100 passes
/// takes about a second at this clock; a board asked for thousands of passes a step will be reset.
const WATCHDOG_S: u32 = 32;

/// Register addresses from ST's RM0090, chapters 3, 7, 8, 18, 21 and 30.
mod register {
    pub const RCC_AHB1ENR: usize = 0x4002_3830;
    pub const RCC_APB1ENR: usize = 0x4002_3840;
    pub const RCC_APB2ENR: usize = 0x4002_3844;
    pub const GPIOA_MODER: usize = 0x4002_0000;
    pub const GPIOA_AFRH: usize = 0x4002_0024;
    pub const USART1_SR: usize = 0x4001_1000;
    pub const USART1_DR: usize = 0x4001_1004;
    pub const USART1_BRR: usize = 0x4001_1008;
    pub const USART1_CR1: usize = 0x4001_100c;
    pub const TIM2_CR1: usize = 0x4000_0000;
    pub const TIM2_CNT: usize = 0x4000_0024;
    pub const TIM2_ARR: usize = 0x4000_002c;
    pub const IWDG_KR: usize = 0x4000_3000;
    pub const IWDG_PR: usize = 0x4000_3004;
    pub const IWDG_RLR: usize = 0x4000_3008;
}

const GPIOA_ENABLE: u32 = 1 << 0;
const TIM2_ENABLE: u32 = 1 << 0;
const USART1_ENABLE: u32 = 1 << 4;
/// PA9 and PA10 in alternate function mode: two bits each.
const PINS_MODE_MASK: u32 = 0b1111 << 18;
const PINS_MODE_ALTERNATE: u32 = 0b1010 << 18;
/// Alternate function 7 (USART1) on both: four bits each.
const PINS_FUNCTION_MASK: u32 = 0xff << 4;
const PINS_FUNCTION_USART: u32 = 0x77 << 4;
const USART_ON: u32 = 1 << 13 | 1 << 3 | 1 << 2;
const USART_RECEIVED: u32 = 1 << 5;
const USART_SENT: u32 = 1 << 7;
const COUNTER_ON: u32 = 1 << 0;
const WATCHDOG_UNLOCK: u32 = 0x5555;
const WATCHDOG_START: u32 = 0xcccc;
const WATCHDOG_FEED: u32 = 0xaaaa;
/// Prescaler code 6: 32 kHz / 256.
const WATCHDOG_PRESCALER: u32 = 6;
const WATCHDOG_RELOAD: u32 = WATCHDOG_S * 32_000 / 256 - 1;
/// Twelve bits.
const _: () = assert!(WATCHDOG_RELOAD < 4096);

// SAFETY: symbols of cortex-m-rt's link.x; only their addresses are taken.
unsafe extern "C" {
    static __vector_table: u32;
    static __veneer_limit: u32;
    static __sdata: u32;
    static _stack_end: u32;
    static _stack_start: u32;
}

/// The peripherals this image uses. There is one, made by [`Board::start`].
pub struct Board(());

impl Board {
    /// Sets clocks, pins, port, counter and watchdog up. Call once, first of all.
    pub fn start() -> Self {
        use register::*;
        set(RCC_AHB1ENR, 0, GPIOA_ENABLE);
        set(RCC_APB1ENR, 0, TIM2_ENABLE);
        set(RCC_APB2ENR, 0, USART1_ENABLE);
        set(GPIOA_AFRH, PINS_FUNCTION_MASK, PINS_FUNCTION_USART);
        set(GPIOA_MODER, PINS_MODE_MASK, PINS_MODE_ALTERNATE);
        write(USART1_BRR, (CLOCK_HZ + BAUD / 2) / BAUD);
        write(USART1_CR1, USART_ON);
        write(TIM2_ARR, u32::MAX);
        write(TIM2_CR1, COUNTER_ON);
        write(IWDG_KR, WATCHDOG_START);
        write(IWDG_KR, WATCHDOG_UNLOCK);
        write(IWDG_PR, WATCHDOG_PRESCALER);
        write(IWDG_RLR, WATCHDOG_RELOAD);
        let board = Self(());
        board.feed_watchdog();
        board
    }

    /// One received byte, if there is one.
    pub fn read_byte(&mut self) -> Option<u8> {
        // Reading the data register after the status register also clears an overrun.
        (read(register::USART1_SR) & USART_RECEIVED != 0)
            .then(|| read(register::USART1_DR).to_le_bytes()[0])
    }

    /// Sends all bytes; waits for the line.
    pub fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            while read(register::USART1_SR) & USART_SENT == 0 {}
            write(register::USART1_DR, u32::from(byte));
        }
    }

    /// Keeps the board from being reset for another [`WATCHDOG_S`] seconds.
    pub fn feed_watchdog(&self) {
        write(register::IWDG_KR, WATCHDOG_FEED);
    }

    /// The free-running counter: timer clocks on a board, instructions in QEMU under
    /// `-icount shift=0`, where the timer runs at 1 GHz of virtual time. Wraps.
    #[inline]
    pub fn ticks(&self) -> u32 {
        read(register::TIM2_CNT)
    }

    /// Memory in use. The stack's depth is how far the paint of the start-up code is gone.
    pub fn budget(&self) -> BudgetFrame {
        let flash_start = (&raw const __vector_table).addr();
        let flash_end = (&raw const __veneer_limit).addr();
        let ram_start = (&raw const __sdata).addr();
        let stack_low = (&raw const _stack_end).addr();
        let stack_high = (&raw const _stack_start).addr();
        let mut unused = stack_low;
        while unused < stack_high && read(unused) == STACK_PAINT_VALUE {
            unused += size_of::<u32>();
        }
        BudgetFrame {
            flash_bytes: (flash_end - flash_start) as u32,
            ram_static_bytes: (stack_low - ram_start) as u32,
            stack_bytes_max: (stack_high - unused) as u32,
            stack_bytes_limit: (stack_high - stack_low) as u32,
        }
    }
}

/// Replaces the bits of `mask` by `bits`, which are set whatever the mask says.
fn set(address: usize, mask: u32, bits: u32) {
    write(address, read(address) & !mask | bits);
}

fn read(address: usize) -> u32 {
    // SAFETY: every caller passes a register above or an aligned word of the stack's RAM.
    unsafe { read_volatile(address as *const u32) }
}

fn write(address: usize, value: u32) {
    // SAFETY: every caller passes one of the registers above; none of them moves memory.
    unsafe { write_volatile(address as *mut u32, value) }
}
