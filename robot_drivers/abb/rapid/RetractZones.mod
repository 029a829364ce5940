MODULE RetractZones
    ! Task T_ROB1, option World Zones: the controller itself keeps the tool inside a box.
    ! Event routine POWER ON; it takes effect with the next restart of the controller.

    LOCAL VAR wzstationary workspace:=[0];

    PROC RetractPowerOn()
        VAR shapedata outside;
        WZBoxDef\Outside,outside,RT_ZONE_LOW,RT_ZONE_HIGH;
        WZLimSup\Stat,workspace,outside;
    ENDPROC
ENDMODULE
