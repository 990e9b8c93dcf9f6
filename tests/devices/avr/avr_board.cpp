// An AVR board under simavr, its serial port on a pseudo-terminal, in real time.
// usage: merkel_avr_board MCU FIRMWARE.elf   prints the name of the terminal; runs until its input
// ends
//
// A0 sees a press every half second: 0 to 1.25 V and back, which the firmware reads as 2.5 N.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

extern "C" {
#include <avr_adc.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>
}

namespace {

constexpr std::uint32_t kClock_Hz = 16'000'000;
constexpr std::uint32_t kSlice = kClock_Hz / 2000;  ///< cycles between looks at the terminal
constexpr double kPress_s = 0.5;
constexpr double kPress_mV = 1250.0;

struct Board {
  int terminal = -1;
  avr_irq_t* input = nullptr;
  bool accepts = true;
  std::deque<std::uint8_t> waiting;  ///< for the board
};

void from_board(avr_irq_t* /*irq*/, std::uint32_t value, void* board) {
  const auto byte = static_cast<std::uint8_t>(value);
  static_cast<void>(!::write(static_cast<Board*>(board)->terminal, &byte, 1));
}

/// simavr calls this as long as the UART can take a byte.
void can_take(avr_irq_t* /*irq*/, std::uint32_t /*value*/, void* param) {
  auto* const board = static_cast<Board*>(param);
  board->accepts = true;
  while (board->accepts && !board->waiting.empty()) {
    const std::uint8_t byte = board->waiting.front();
    board->waiting.pop_front();
    avr_raise_irq(board->input, byte);
  }
}

void is_full(avr_irq_t* /*irq*/, std::uint32_t /*value*/, void* param) {
  static_cast<Board*>(param)->accepts = false;
}

/// simavr's messages would go to the standard output.
void no_log(avr_t* /*avr*/, int /*level*/, const char* /*format*/, va_list /*words*/) {}

int open_terminal() {
  const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
  if (terminal < 0 || ::grantpt(terminal) != 0 || ::unlockpt(terminal) != 0) return -1;
  // The other end stays open, so that a reader may come and go.
  const int other = ::open(::ptsname(terminal), O_RDWR | O_NOCTTY);
  termios raw{};
  ::tcgetattr(other, &raw);
  ::cfmakeraw(&raw);
  ::tcsetattr(other, TCSANOW, &raw);
  return terminal;
}

bool input_has_ended() {
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  char byte = 0;
  return ::poll(&input, 1, 0) > 0 && ::read(STDIN_FILENO, &byte, 1) <= 0;
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) return 2;
  avr_global_logger_set(no_log);
  elf_firmware_t firmware{};
  avr_t* const avr = avr_make_mcu_by_name(words[1]);
  if (elf_read_firmware(words[2], &firmware) != 0 || avr == nullptr) return 2;
  avr_init(avr);
  avr_load_firmware(avr, &firmware);
  avr->frequency = kClock_Hz;
  avr->vcc = avr->avcc = avr->aref = 5000;

  Board board;
  board.terminal = open_terminal();
  if (board.terminal < 0) return 1;
  std::uint32_t flags = 0;  // no copy to the standard output, no sleep
  avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  const auto uart = [avr](int index) {
    return avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), index);
  };
  board.input = uart(UART_IRQ_INPUT);
  avr_irq_register_notify(uart(UART_IRQ_OUTPUT), from_board, &board);
  avr_irq_register_notify(uart(UART_IRQ_OUT_XON), can_take, &board);
  avr_irq_register_notify(uart(UART_IRQ_OUT_XOFF), is_full, &board);
  avr_irq_t* const force = avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0);

  std::printf("%s\n", ::ptsname(board.terminal));
  std::fflush(stdout);
  const auto started = std::chrono::steady_clock::now();
  while (!input_has_ended()) {
    const double time_s = static_cast<double>(avr->cycle) / kClock_Hz;
    const double phase = std::fmod(time_s, kPress_s) / kPress_s;
    const double press = std::max(0.0, 1.0 - std::abs(4.0 * phase - 1.0));  // in its first half
    avr_raise_irq(force, static_cast<std::uint32_t>(kPress_mV * press));
    std::uint8_t byte = 0;
    while (::read(board.terminal, &byte, 1) == 1) board.waiting.push_back(byte);
    if (board.accepts) can_take(nullptr, 0, &board);
    for (const avr_cycle_count_t end = avr->cycle + kSlice; avr->cycle < end;) {
      const int state = avr_run(avr);
      if (state == cpu_Done || state == cpu_Crashed) return 1;
    }
    std::this_thread::sleep_until(
        started + std::chrono::duration_cast<std::chrono::nanoseconds>(
                      std::chrono::duration<double>(static_cast<double>(avr->cycle) / kClock_Hz)));
  }
  return 0;
}
