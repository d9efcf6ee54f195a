#pragma once
// The subcommands, one source file each.

#include <memory>
#include <vector>

#include "cli/command.h"

namespace polestar::cli {

std::unique_ptr<Command> makeBatchCommand();
std::unique_ptr<Command> makeCheckCommand();
std::unique_ptr<Command> makeMapCommand();
std::unique_ptr<Command> makeEvalCommand();
std::unique_ptr<Command> makeInfoCommand();
std::unique_ptr<Command> makeIsoCommand();
std::unique_ptr<Command> makeRenderCommand();
std::unique_ptr<Command> makeTransferCommand();
std::unique_ptr<Command> makeMorphCommand();
std::unique_ptr<Command> makeWarpCommand();
std::unique_ptr<Command> makeVerifyCommand();
std::unique_ptr<Command> makeConvertCommand();

/// All of them, in the order of the help.
std::vector<std::unique_ptr<Command>> makeCommands();

}  // namespace polestar::cli
