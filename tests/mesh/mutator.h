#pragma once
// Seeded damage to the bytes of a file.

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <string_view>

namespace polestar::testing {

class Mutator {
 public:
  explicit Mutator(unsigned seed) : random_(seed) {}

  std::string operator()(std::string bytes) {
    for (std::size_t steps = 1 + below(4); steps > 0; --steps) mutate(bytes);
    return bytes;
  }

 private:
  std::size_t below(std::size_t n) { return n == 0 ? 0 : random_() % n; }

  void mutate(std::string& bytes) {
    static constexpr std::array<std::string_view, 16> kWords{
        "nan", "-1", "inf",  "1e999", "4294967295", "18446744073709551615", "0",  "-2147483648",
        "\n",  "#",  "\\\n", "/",     "list",       "element x 99999999",   "\r", "999999999"};
    const std::size_t at = below(bytes.size());
    const std::size_t length = std::min(bytes.size() - at, 1 + below(40));
    switch (below(8)) {
      case 0:
        bytes.resize(at);
        break;
      case 1:
        bytes[std::min(at, bytes.size())] = static_cast<char>(random_());
        break;
      case 2:
        bytes.erase(at, length);
        break;
      case 3:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 4:
        bytes.insert(at, kWords[below(kWords.size())]);
        break;
      case 5: {
        const std::string_view word = kWords[below(kWords.size())];
        bytes.replace(at, std::min(word.size(), bytes.size() - at), word);
        break;
      }
      case 6:
        std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                    std::min<std::size_t>(4, bytes.size() - at), '\xFF');
        break;
      default:
        std::swap(bytes[at], bytes[below(bytes.size())]);
        break;
    }
    if (bytes.empty()) bytes = "\n";
  }

  std::mt19937 random_;
};

}  // namespace polestar::testing
