// polestar: the command-line tool. Every subcommand lives in its own cmd_<name>.cpp; what they share is in
// cli/.

#include "commands.h"

namespace polestar::cli {

std::vector<std::unique_ptr<Command>> makeCommands() {
  std::vector<std::unique_ptr<Command>> commands;
  commands.push_back(makeCheckCommand());
  commands.push_back(makeMapCommand());
  commands.push_back(makeEvalCommand());
  commands.push_back(makeVerifyCommand());
  commands.push_back(makeInfoCommand());
  commands.push_back(makeTransferCommand());
  commands.push_back(makeRenderCommand());
  commands.push_back(makeMorphCommand());
  commands.push_back(makeIsoCommand());
  commands.push_back(makeWarpCommand());
  commands.push_back(makeConvertCommand());
  commands.push_back(makeBatchCommand());
  return commands;
}

}  // namespace polestar::cli

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  return polestar::cli::runCommandLine(polestar::cli::makeCommands(), words);
}
