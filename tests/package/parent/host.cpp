// Runs the plugin.
extern "C" int plugin_check();

int main() { return plugin_check(); }
