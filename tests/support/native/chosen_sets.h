/* Reports the instruction sets in the environment variable CHOSEN_SETS as available.
 *
 * chosen_sets.h is included before all other files. */
extern char *getenv(const char *name);

static inline int chosen_sets_have(const char *set)
{
    const char *chosen = getenv("CHOSEN_SETS");
    return chosen && __builtin_strstr(chosen, set);
}
