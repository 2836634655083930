/* Reports the instruction sets in the environment variable CHOSEN_SETS as available.
 *
 * This file is included before all other files, so it declares getenv itself. Files included after
 * it set macros that select the declarations in system headers. So this file must not include a
 * system header. */
extern char *getenv(const char *name);

static inline int chosen_sets_have(const char *set)
{
    const char *chosen = getenv("CHOSEN_SETS");
    return chosen && __builtin_strstr(chosen, set);
}
