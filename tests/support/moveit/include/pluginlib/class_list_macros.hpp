/** Stub of pluginlib: a function of the library creates its plugin. */
#ifndef STUB_CLASS_LIST_MACROS_HPP
#define STUB_CLASS_LIST_MACROS_HPP

#define PLUGINLIB_EXPORT_CLASS(Plugin, Base) \
    Base *created_plugin()                   \
    {                                        \
        return new Plugin();                 \
    }

#endif
