// polestar check: is this mesh a star-shaped solid, where is its center, and if not, what stands in the way?

#include "cli/dry_run.h"
#include "cli/solid_input.h"
#include "cli/text.h"
#include "commands.h"

namespace polestar::cli {
namespace {

class CheckCommand final : public Command {
 public:
  Description description() const override {
    return {"check", "Is a mesh a star-shaped solid? Finds its center, or names what is wrong and where",
            "Write the answer to FILE (when it is yes) instead of standard output",
            "polestar check asteroid.obj --json"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("MESH", mesh_, "Surface mesh: .obj, .ply, .stl or .off; or a .vdb with a level set or fog")
        ->required()
        ->type_name("");
    addCenterOption(app, star_.center);
    app.add_option("--rays", star_.rays, "Rays over the sphere for the second opinion; 0: none")
        ->check(CLI::NonNegativeNumber.description(""))
        ->capture_default_str()
        ->type_name("N");
  }

  void run(Session& session) override {
    session.addInput(mesh_);
    session.sendAnswerToOutput();
    if (session.options().dryRun) {
      describePlan(session);
      return;
    }
    inspectSolid(mesh_, star_, session);
  }

 private:
  std::filesystem::path mesh_;
  StarOptions star_;
};

}  // namespace

std::unique_ptr<Command> makeCheckCommand() { return std::make_unique<CheckCommand>(); }

}  // namespace polestar::cli
